// Grids out of a .vdb file that may be damaged or hostile. Not installed.
#pragma once

#include "openvdb_access.h"

#include <cstdint>
#include <filesystem>

namespace vdbfrac::grid {

/// Reads every grid of a kind this library knows (float, double, int32, int64, vec3s, vec3d, vec3i), and skips others.
/// Magic, version, and every size that the file declares are checked against the size of the file before anything is
/// allocated for it; a file that ends early is an error. Throws FileError; LimitError before a grid is read that takes
/// more than `memoryLimit` bytes by its own account, if a file of that size can hold such a grid. A file that lies
/// takes 40 times its size at most: a leaf has 64 bytes or more.
openvdb::GridPtrVec readGrids(const std::filesystem::path& file, std::uint64_t memoryLimit = ~std::uint64_t{0});

/// A grid with a surface at its zero: the one of that name, or the first level set, or the first float grid of no
/// class. Checked as readLevelSet does, but for its transform, which is only linear. Throws FileError, InputError,
/// LimitError.
openvdb::FloatGrid::Ptr readSdf(const std::filesystem::path& file, const std::string& name, std::uint64_t memoryLimit);

/// OpenVDB below 11 copies chunks of a declared size into buffers of another. Calling this links our checked
/// replacements of io::bloscFromStream and io::unzipFromStream into the program; they take precedence over the
/// library's own when the executable exports its symbols (-rdynamic; ENABLE_EXPORTS in CMake).
void useCheckedDecompression();

}  // namespace vdbfrac::grid
