// Voxels whose energy may exceed a threshold, found without a look at all the others.
#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <compare>

namespace vdbfrac::grid {

namespace {

using tetmesh::Cell;
using tetmesh::CutMesh;
using tetmesh::kMostTets;
using tetmesh::Piece;

/// Sorts and drops what is there twice. Where the box of all is well filled, it is swept instead.
void sortUnique(std::vector<Coord>& coords)
{
    if (coords.empty()) return;
    Coord lower = coords[0], upper = coords[0];
    for (const Coord& c : coords) {
        lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
        upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
    const Coord size = upper - lower + Coord{1, 1, 1};
    constexpr double kSparse = 32;  // places to sweep for each coordinate that would have to be sorted
    if (double(size.x) * size.y * size.z > kSparse * double(coords.size())) {
        std::sort(coords.begin(), coords.end());
        coords.erase(std::unique(coords.begin(), coords.end()), coords.end());
        return;
    }
    std::vector<std::uint8_t> marks(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z));
    for (const Coord& c : coords) {
        const Coord d = c - lower;
        marks[(std::size_t(d.z) * std::size_t(size.y) + std::size_t(d.y)) * std::size_t(size.x) + std::size_t(d.x)] = 1;
    }
    coords.clear();
    auto mark = marks.begin();
    for (int z = lower.z; z <= upper.z; ++z)
        for (int y = lower.y; y <= upper.y; ++y)
            for (int x = lower.x; x <= upper.x; ++x)
                if (*mark++) coords.push_back({x, y, z});
}

/// Voxels in a row along x.
struct Row {
    int z, y, first, last;
    auto operator<=>(const Row&) const = default;
};

/// Sorts, and joins rows that touch.
void joinRows(std::vector<Row>& rows)
{
    std::sort(rows.begin(), rows.end());
    std::size_t count = 0;
    for (const Row& row : rows) {
        Row* before = count > 0 ? &rows[count - 1] : nullptr;
        if (before && before->z == row.z && before->y == row.y && row.first <= before->last + 1)
            before->last = std::max(before->last, row.last);
        else
            rows[count++] = row;
    }
    rows.resize(count);
}

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
    const auto add = [&](const tetmesh::SubTet& sub, std::size_t element) {
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

std::vector<Coord> voxelsAbove(const CutMesh& mesh, std::span<const double> density, double threshold)
{
    constexpr std::size_t kElements = 4096, kRow = 8;
    const std::size_t elements = mesh.elements().size();
    std::vector<std::vector<Coord>> part((elements + kElements - 1) / kElements);
    const auto anyAbove = [&](std::size_t begin, std::size_t end) {
        std::int64_t above = 0;  // no early way out: this runs through all tets of a body, and a plain loop is fastest
        for (std::size_t i = begin * kMostTets; i < end * kMostTets; ++i) above += density[i] > threshold;
        return above > 0;
    };
    parallelChunks(elements, kElements, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint8_t> marks;
        for (std::size_t row = begin; row < end; row += kRow) {
            const std::size_t rowEnd = std::min(end, row + kRow);
            if (!anyAbove(row, rowEnd)) continue;
            for (std::size_t e = row; e < rowEnd;) {
                const Cell& cell = cellOf(mesh, e);
                const auto own = density.subspan(cell.firstElement * kMostTets, cell.elements * kMostTets);
                if (anyAbove(cell.firstElement, cell.firstElement + cell.elements))
                    addVoxelsAbove(mesh, cell, own, threshold, marks, part[begin / kElements]);
                e = cell.firstElement + cell.elements;
            }
        }
    });
    std::vector<Coord> voxels;
    for (const auto& p : part) voxels.insert(voxels.end(), p.begin(), p.end());
    sortUnique(voxels);
    return voxels;
}

std::vector<Coord> voxelsAround(std::span<const Coord> voxels, int reach)
{
    // Axis by axis, on rows of voxels: as many rows as the result has, not as many voxels as all the boxes hold.
    std::vector<Row> rows;
    for (const Coord& c : voxels) rows.push_back({c.z, c.y, c.x - reach, c.x + reach});
    joinRows(rows);
    for (int Row::*axis : {&Row::y, &Row::z}) {
        std::vector<Row> wide;
        for (const Row& row : rows)
            for (int d = -reach; d <= reach; ++d) {
                wide.push_back(row);
                wide.back().*axis += d;
            }
        joinRows(wide);
        rows = std::move(wide);
    }
    std::vector<Coord> all;
    for (const Row& row : rows)
        for (int x = row.first; x <= row.last; ++x) all.push_back({x, row.y, row.z});
    return all;
}

}  // namespace vdbfrac::grid
