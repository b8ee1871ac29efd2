// Polygon meshes of users: read strictly, and looked at before anything is built from them.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// Reads an .obj, .ply (text, little and big endian), .stl (text, binary) or .off (text) file; the extension
/// chooses, in upper or lower case. Only positions and faces are kept. Every coordinate of the result is finite,
/// every index in range, every polygon has at least 3 corners: faces with fewer are dropped. Numbers do not depend
/// on the locale. STL corners with the same bits become one point. Units are those of the file.
/// Throws InputError with file:line (text) or file and element (binary); FileError when the file cannot be read;
/// LimitError, before anything is read, when a file of its size may take more than `memoryLimit` bytes.
PolygonSoup readSurface(const std::filesystem::path& file, std::uint64_t memoryLimit = ~std::uint64_t{0});

/// For every point the lowest number of a point with equal coordinates.
std::vector<std::size_t> equalPoints(std::span<const Vec3> points);

/// What a soup looks like as the boundary of a solid. Points with equal coordinates count as one, so seams that
/// only split the vertices of a file do not open the surface.
struct SurfaceReport {
    bool closed = false;               ///< every edge has an even, non-zero number of faces
    std::size_t openEdges = 0;         ///< edges with an odd number of faces
    std::size_t nonManifoldEdges = 0;  ///< edges with more than two faces
    bool oriented = false;             ///< closed, and faces agree at every edge about which side is outside
    std::size_t degenerateFaces = 0;   ///< faces without area, or with a corner twice
    double area = 0;                   ///< [m^2]
    double volume = 0;                 ///< signed [m^3]; positive when the faces look outward. Only for closed ones
    Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();  ///< of the points that faces use [m]
};
SurfaceReport examine(const PolygonSoup& soup);

}  // namespace vdbfrac::tetmesh
