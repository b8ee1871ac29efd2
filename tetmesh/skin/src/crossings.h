// Where the surface of the cracks, c = 0, meets the outer surface. Not installed.
//
// Two sets of simplices meet: points, edges E and triangles T of the skin; nodes, edges e, faces f and tets of the
// lattice. c is linear along E in a tet and on T in a face, so each such pair has one crossing at most:
//   E in a tet   between the points where E enters and leaves it
//   T in a face  between two of: an edge of T through the face, an edge of the face through T
// In a tet, c = 0 cuts T along a segment between two crossings. Which simplices meet is decided exactly (CGAL's
// filtered predicates), so all tets and triangles round a crossing agree on it, and its coordinates are computed from
// the pair alone: neighbours find the same bits.
#pragma once

#include "crack_lattice.h"
#include "skin_topology.h"

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::skin {

struct Crossing {
    bool onEdge = false;     ///< of an edge in a tet; else of a triangle in a face
    std::uint32_t skin = 0;  ///< the edge or the triangle
    SimplexKey lattice = 0;  ///< the tet or the face
    Vec3 X = Vec3::Zero();   ///< m
    Coord anchor;            ///< node of the side of the crack that the crossing belongs to
};

/// What a tet's part of c = 0 cuts out of a triangle.
struct RimSegment {
    std::uint32_t triangle = 0;
    SimplexKey tet = 0;
    std::array<std::uint32_t, 2> crossing{};
};

/// An edge of the lattice goes through a triangle.
struct Piercing {
    SimplexKey edge = 0;
    std::uint32_t triangle = 0;
    bool open = false;  ///< c > 0 there
};

struct Crossings {
    std::vector<Crossing> points;       ///< sorted by onEdge, skin, lattice
    std::vector<RimSegment> segments;   ///< sorted by triangle, tet
    std::vector<Piercing> piercings;    ///< sorted by edge, triangle; of edges of mixed tets
    std::vector<std::uint32_t> looked;  ///< triangles in mixed voxels, rising
    std::int64_t defects = 0;           ///< segments without two ends: 0 but for rounding
};

Crossings findCrossings(const SkinTopology& skin, const CrackLattice& lattice);

/// Does the point of the skin lie in a crack?
bool isOpen(const CrackLattice& lattice, const Vec3& X);
/// Node of the side of the crack that X belongs to; X is not in a crack.
Coord anchorOf(const CrackLattice& lattice, const Vec3& X);

}  // namespace vdbfrac::skin
