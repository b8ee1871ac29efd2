// The sub-tets of one lattice cell, and those round one lattice node, in voxel coordinates.
//
// A lattice cell spans m x m x m voxels (m: coarsening). Each voxel is divided into sub-tets; each sub-tet lies in
// exactly one tet of the cell, its parent: Kuhn tets of a refined grid nest.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cell.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::tetmesh {

/// Largest coarsening. Stencils number their vertices with 16 bits: the box round a node has 59 319 voxels at 19, more
/// than 65 535 at 20.
inline constexpr int kMaxCoarsening = 19;

struct Lattice {
    enum class Kind : std::uint8_t { six, five };
    Kind kind = Kind::six;
    int coarsening = 1;    ///< m, up to kMaxCoarsening; 1 for `five`, whose grids do not nest
    double voxelSize = 1;  ///< dx [m]
    /// Tets with a voxel node half a voxel or more inside are material, nearly all of them, the others not.
    bool wholeTets = false;

    double spacing() const { return coarsening * voxelSize; }  ///< h [m]
    CellShape shapeOf(Coord cell) const
    {
        if (kind == Kind::six) return CellShape::six;
        return (cell.x + cell.y + cell.z) & 1 ? CellShape::fiveOdd : CellShape::fiveEven;
    }
};

/// Corner c of a unit cell.
inline Coord cornerOffset(int c) { return {c & 1, c >> 1 & 1, c >> 2 & 1}; }

/// The Kuhn tet that holds a point of the unit cell: its first corners are reached along the axes by falling
/// coordinate.
std::uint8_t kuhnTetOf(const Vec3& p);

struct SubTet {
    std::array<std::uint16_t, 4> vertex;  ///< indices into the stencil's vertices
    std::uint8_t parent;                  ///< tet of the cell
    Coord voxel;                          ///< lowest corner of the voxel it is part of
};

/// Sub-tets of a cell. Vertices are offsets from the cell's lowest voxel coordinate.
struct CellStencil {
    std::vector<Coord> vertices;
    std::vector<SubTet> subTets;
};
CellStencil makeCellStencil(const Lattice& lattice, CellShape shape);

/// All sub-tets whose parent tet has a certain lattice node as a corner: the node's star.
/// Vertices are offsets from the node's voxel coordinate; `find` gives a vertex' index from its offset. After those of
/// the sub-tets come the other corners of their voxels.
struct StarStencil {
    struct Tet {
        std::array<std::uint16_t, 4> vertex;
        std::uint8_t corner;   ///< the node is this corner of its cell
        std::uint32_t subTet;  ///< of the cell's stencil
    };
    int reach = 0;  ///< offsets lie in [-m, m]
    std::vector<Coord> vertices;
    std::size_t ofTets = 0;  ///< vertices of sub-tets
    std::vector<Tet> subTets;
    std::vector<std::int32_t> index;  ///< -1 where the offset is none of a vertex

    int find(Coord offset) const
    {
        const int n = 2 * reach + 1;
        const Coord c = offset + Coord{reach, reach, reach};
        return index[std::size_t((c.z * n + c.y) * n + c.x)];
    }
};
/// `odd`: parity of the node's lattice coordinates (only `five` cares).
StarStencil makeStarStencil(const Lattice& lattice, bool odd);

}  // namespace vdbfrac::tetmesh
