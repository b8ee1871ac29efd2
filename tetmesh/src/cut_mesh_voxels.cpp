// Voxels of a cut lattice: those whose energy may exceed a threshold, and the material round each.
#include "coord_ranges.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>
#include <array>

namespace vdbfrac::tetmesh {

namespace {

const Cell& cellOf(const CutMesh& mesh, std::size_t element)
{
    const auto after = std::upper_bound(mesh.cells().begin(), mesh.cells().end(), element,
                                        [](std::size_t e, const Cell& cell) { return e < cell.firstElement; });
    return after[-1];
}

/// Adds the voxel nodes of a cell's sub-tets above the threshold. `density`: of the cell's tets; `marks`: scratch.
void addVoxelsAbove(const CutMesh& mesh, const Cell& cell, std::span<const double> density, double threshold,
                    std::vector<std::uint8_t>& marks, std::vector<Coord>& voxels)
{
    const auto& stencil = mesh.stencil(mesh.lattice().shapeOf(cell.coord));
    marks.assign(stencil.vertices.size(), 0);
    const auto add = [&](const SubTet& sub, std::size_t element) {
        if (!(density[tetEntry(element, sub.parent)] > threshold)) return;
        for (std::uint16_t v : sub.vertex) marks[v] = 1;
    };
    if (cell.whole)
        for (const auto& sub : stencil.subTets) add(sub, 0);
    else
        for (const Piece& piece : cell.pieces) add(stencil.subTets[piece.subTet], piece.element);
    for (std::size_t v = 0; v < marks.size(); ++v)
        if (marks[v]) voxels.push_back(mesh.lattice().coarsening * cell.coord + stencil.vertices[v]);
}

}  // namespace

std::vector<Coord> CutMesh::voxelsAbove(std::span<const double> density, double threshold) const
{
    constexpr std::size_t kElements = 4096, kRow = 8;
    const std::size_t elements = elements_.size();
    const auto anyAbove = [&](std::size_t begin, std::size_t end) {
        std::int64_t above = 0;  // no early way out: this runs through all tets of a body, and a plain loop is fastest
        for (std::size_t i = begin * kMaxTets; i < end * kMaxTets; ++i) above += density[i] > threshold;
        return above > 0;
    };
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<Coord>& above) {
        if (!anyAbove(begin, end)) return;  // nearly always
        std::vector<std::uint8_t> marks;
        for (std::size_t row = begin; row < end; row += kRow) {
            const std::size_t rowEnd = std::min(end, row + kRow);
            if (!anyAbove(row, rowEnd)) continue;
            for (std::size_t e = row; e < rowEnd;) {
                const Cell& cell = cellOf(*this, e);
                const auto own = density.subspan(tetEntry(cell.firstElement, 0), tetEntry(cell.elements, 0));
                if (anyAbove(cell.firstElement, cell.firstElement + cell.elements))
                    addVoxelsAbove(*this, cell, own, threshold, marks, above);
                e = cell.firstElement + cell.elements;
            }
        }
    };
    std::vector<Coord> voxels = gatherChunks<Coord>(elements, kElements, add);
    sortUniqueCoords(voxels);
    return voxels;
}

namespace {

/// A tet of a cell, and which of its vertices is a certain corner.
struct TetVertex {
    std::uint8_t tet, vertex;
};
struct CornerTets {
    std::array<std::array<TetVertex, kMaxTets>, kCorners> at{};
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
void addTetsOf(const CutMesh& mesh, Coord voxelCell, int k, std::vector<TetShare>& to)
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
        to.push_back({cell.firstElement + (piece ? piece->element : 0u), subTets[first + t].parent, part});
    }
}

}  // namespace

void CutMesh::addTetsRound(Coord voxel, std::vector<TetShare>& tets) const
{
    for (int k = 0; k < kCorners; ++k) addTetsOf(*this, voxel - cornerOffset(k), k, tets);
}

}  // namespace vdbfrac::tetmesh
