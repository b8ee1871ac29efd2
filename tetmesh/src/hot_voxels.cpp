// Voxels whose energy may exceed a threshold, found without a look at all the others.
#include "coord_ranges.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>

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
        if (!(density[element * kMostTets + sub.parent] > threshold)) return;
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
    std::vector<std::vector<Coord>> part((elements + kElements - 1) / kElements);
    const auto anyAbove = [&](std::size_t begin, std::size_t end) {
        std::int64_t above = 0;  // no early way out: this runs through all tets of a body, and a plain loop is fastest
        for (std::size_t i = begin * kMostTets; i < end * kMostTets; ++i) above += density[i] > threshold;
        return above > 0;
    };
    parallelChunks(elements, kElements, [&](std::size_t begin, std::size_t end) {
        if (!anyAbove(begin, end)) return;  // nearly always
        std::vector<std::uint8_t> marks;
        for (std::size_t row = begin; row < end; row += kRow) {
            const std::size_t rowEnd = std::min(end, row + kRow);
            if (!anyAbove(row, rowEnd)) continue;
            for (std::size_t e = row; e < rowEnd;) {
                const Cell& cell = cellOf(*this, e);
                const auto own = density.subspan(cell.firstElement * kMostTets, cell.elements * kMostTets);
                if (anyAbove(cell.firstElement, cell.firstElement + cell.elements))
                    addVoxelsAbove(*this, cell, own, threshold, marks, part[begin / kElements]);
                e = cell.firstElement + cell.elements;
            }
        }
    });
    std::vector<Coord> voxels;
    for (const auto& p : part) voxels.insert(voxels.end(), p.begin(), p.end());
    sortUniqueCoords(voxels);
    return voxels;
}

}  // namespace vdbfrac::tetmesh
