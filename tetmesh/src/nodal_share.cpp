#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>
#include <array>

namespace vdbfrac::tetmesh {

namespace {

/// A tet of a cell, and which of its vertices is a certain corner.
struct TetVertex {
    std::uint8_t tet, vertex;
};
struct CornerTets {
    std::array<std::array<TetVertex, kMostTets>, kCorners> at{};
    std::array<std::size_t, kCorners> count{};
};

constexpr CornerTets makeCornerTets(const CellTets& tets)
{
    CornerTets table;
    for (int t = 0; t < tets.count; ++t)
        for (std::size_t a = 0; a < 4; ++a) {
            const std::size_t corner = std::size_t(tets.corner[std::size_t(t)][a]);
            table.at[corner][table.count[corner]++] = {std::uint8_t(t), std::uint8_t(a)};
        }
    return table;
}
template <CellShape shape>
constexpr CornerTets kCornerTets = makeCornerTets(kCellTets<shape>);

/// The tets of a cell that have a corner of it as a vertex, by rising number.
std::span<const TetVertex> tetsAt(CellShape shape, int corner)
{
    const CornerTets& table = shape == CellShape::six        ? kCornerTets<CellShape::six>
                              : shape == CellShape::fiveEven ? kCornerTets<CellShape::fiveEven>
                                                             : kCornerTets<CellShape::fiveOdd>;
    return std::span(table.at[std::size_t(corner)]).first(table.count[std::size_t(corner)]);
}

const Piece* pieceOf(const Cell& cell, std::size_t subTet)
{
    const auto it = std::lower_bound(cell.pieces.begin(), cell.pieces.end(), subTet,
                                     [](const Piece& p, std::size_t s) { return p.subTet < s; });
    return it != cell.pieces.end() && it->subTet == subTet ? &*it : nullptr;
}

/// Adds the sub-tets of one voxel cell that have its corner k as a vertex.
void addVoxelCell(const CutMesh& mesh, Coord voxelCell, int k, const TetEnergy& energy, NodalShare& share)
{
    const int m = mesh.lattice().coarsening;
    const Coord coarse{floorDiv(voxelCell.x, m), floorDiv(voxelCell.y, m), floorDiv(voxelCell.z, m)};
    const std::int32_t index = mesh.cellAt(coarse);
    if (index < 0) return;
    const Cell& cell = mesh.cells()[std::size_t(index)];
    const CellShape shape = mesh.lattice().shapeOf(coarse);
    const auto& tets = cellTets(shape);
    const Coord local = voxelCell - m * coarse;
    const std::size_t first = std::size_t(((local.z * m + local.y) * m + local.x) * tets.count);
    const auto& subTets = mesh.stencil(shape).subTets;
    for (const auto [t, a] : tetsAt(shape, k)) {
        const Piece* piece = cell.whole ? nullptr : pieceOf(cell, first + t);
        if (!cell.whole && !piece) continue;
        const double part = tets.volume[t] * (piece ? piece->cut.moment[a] : 0.25);
        const int parent = subTets[first + t].parent;
        share.volume += part;
        share.energy += part * energy(cell.firstElement + (piece ? piece->element : 0u), parent);
    }
}

}  // namespace

NodalShare CutMesh::nodalShare(Coord voxel, const TetEnergy& energy) const
{
    NodalShare share;
    for (int k = 0; k < kCorners; ++k) addVoxelCell(*this, voxel - cornerOffset(k), k, energy, share);
    return share;
}

}  // namespace vdbfrac::tetmesh
