// Triangle surfaces as files for other programs.
#pragma once

#include <vdbfrac/tetmesh/surface.h>

#include <filesystem>

namespace vdbfrac::tetmesh {

/// Is this the extension of a surface that writeSurface writes: .obj, .ply or .stl, in upper or lower case?
bool isSurfaceFile(const std::filesystem::path& file);

/// Writes a surface atomically and verified; the extension chooses.
///   .obj  an object for each fragment, torn faces apart from old skin (obj_file.h); no material library
///   .ply  binary, little-endian; coordinates are doubles, faces have `fragment` (int) and `torn` (0 or 1)
///   .stl  binary; coordinates are floats, and neither fragments nor torn faces are told apart
/// Throws InputError for another extension, FileError.
void writeSurface(const std::filesystem::path& file, const Surface& surface);

}  // namespace vdbfrac::tetmesh
