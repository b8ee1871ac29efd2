// Tets with shared points: what mesh files hold, and what the Delaunay mesher makes.
#pragma once

#include <vdbfrac/base/vec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// A conforming mesh of tets: two of them meet in a face, an edge, a point, or not at all.
struct TetMesh {
    std::vector<Vec3> points;                            ///< [m]
    std::vector<std::array<std::uint32_t, 4>> tets;      ///< (p1-p0) x (p2-p0) . (p3-p0) > 0
    std::vector<std::array<std::uint32_t, 3>> boundary;  ///< its surface, counter-clockwise seen from outside
};

/// Corners of the face opposite each corner of a tet, outward where the tet has positive volume.
inline constexpr std::size_t kTetFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/// The same tet with its lowest number first and its orientation kept.
std::array<std::uint32_t, 4> lowestFirst(std::array<std::uint32_t, 4> tet);

/// The faces that one tet alone has, outward for tets of positive volume, in the order of their tets.
std::vector<std::array<std::uint32_t, 3>> boundaryOf(std::span<const std::array<std::uint32_t, 4>> tets);

/// Volume of tet t [m^3]; negative when it is inverted.
double tetVolume(const TetMesh& mesh, std::size_t t);
/// Volume of all [m^3].
double volumeOf(const TetMesh& mesh);

}  // namespace vdbfrac::tetmesh
