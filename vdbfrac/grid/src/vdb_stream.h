// Grids out of a .vdb file that may be damaged or hostile. Not installed.
#pragma once

#include "openvdb_access.h"

#include <filesystem>

namespace vdbfrac::grid {

/// Reads every grid of a kind this library knows (float, double, int32, int64, bool, vec3s, vec3d, vec3i). Magic,
/// version, and every size that the file declares are checked against the size of the file before anything is
/// allocated for it; a file that ends early is an error. Throws FileError.
openvdb::GridPtrVec readGrids(const std::filesystem::path& file);

/// OpenVDB below 11 copies chunks of a declared size into buffers of another. Calling this links our checked
/// replacements of io::bloscFromStream and io::unzipFromStream into the program; they take precedence over the
/// library's own when the executable exports its symbols (-rdynamic; ENABLE_EXPORTS in CMake).
void useCheckedDecompression();

}  // namespace vdbfrac::grid
