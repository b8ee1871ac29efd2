// Frames of a run as .obj files: an object for each fragment, its torn faces apart from its old skin.
#pragma once

#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/surface.h>

#include <filesystem>
#include <span>
#include <string>

namespace vdbfrac::tetmesh {

/// Writes a surface atomically. Fragments come in the order of their ids as `o fragment_0003`, then its points, then
/// `g fragment_0003_outside` / `usemtl outside` and `g fragment_0003_inside` / `usemtl inside` where it has such faces.
/// A point that several fragments use is written once for each; points keep their order, 9 significant digits.
/// `mtlName` is the material library as the file shall name it; empty leaves it out. Throws FileError.
void writeObj(const std::filesystem::path& file, const Surface& surface, const std::string& mtlName);

/// Faces of each fragment, by rising ids: the order in which frames have them.
std::vector<std::vector<std::uint32_t>> facesOfFragments(const DrawnTopology& drawn);

/// Writes a frame atomically: fragments as writeObj has them, with texture coordinates and normals, and with the groups
/// and materials of the mesh where it has them; one body after the other. Throws FileError.
void writeObjFrame(const std::filesystem::path& file, std::span<const DrawnPart> bodies, const std::string& mtlName);

/// The same as one object, without `o`: the points of each body that faces use, in their order (usedPoints), then all
/// faces in the groups of their fragments. What a file of positions by frames goes with.
void writeObjWhole(const std::filesystem::path& file, std::span<const DrawnPart> bodies, const std::string& mtlName);

/// Reads what these wrote, with fragment ids and torn flags; normals are as deformed. Throws InputError with file:line,
/// FileError.
DrawnTopology readDrawnObj(const std::filesystem::path& file);
/// Its triangles.
Surface readObjFrame(const std::filesystem::path& file);

}  // namespace vdbfrac::tetmesh
