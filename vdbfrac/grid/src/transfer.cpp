#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>

namespace vdbfrac::grid {

namespace {

using tetmesh::Cell;
using tetmesh::CellShape;
using tetmesh::CutMesh;
using tetmesh::kMostTets;
using tetmesh::Piece;

int floorDiv(int a, int m) { return a >= 0 ? a / m : -((m - 1 - a) / m); }

/// Material round a voxel node: sum of the integrals of N_p, and of those times the energy, in units of a voxel.
struct Share {
    double volume = 0, energy = 0;
};

/// A tet of a cell, and which of its vertices is a certain corner.
struct TetVertex {
    std::uint8_t tet, vertex;
};
struct CornerTets {
    std::array<std::array<TetVertex, tetmesh::kMostTets>, tetmesh::kCorners> at{};
    std::array<std::size_t, tetmesh::kCorners> count{};
};

constexpr CornerTets makeCornerTets(const tetmesh::CellTets& tets)
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
constexpr CornerTets kCornerTets = makeCornerTets(tetmesh::kCellTets<shape>);

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
void addVoxelCell(const CutMesh& mesh, Coord voxelCell, int k, const TetEnergy& energy, Share& share)
{
    const int m = mesh.lattice().coarsening;
    const Coord coarse{floorDiv(voxelCell.x, m), floorDiv(voxelCell.y, m), floorDiv(voxelCell.z, m)};
    const std::int32_t index = mesh.cellAt(coarse);
    if (index < 0) return;
    const Cell& cell = mesh.cells()[std::size_t(index)];
    const CellShape shape = mesh.lattice().shapeOf(coarse);
    const auto& tets = tetmesh::cellTets(shape);
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

Share shareOf(const CutMesh& mesh, Coord voxel, const TetEnergy& energy)
{
    Share share;
    for (int k = 0; k < tetmesh::kCorners; ++k)
        addVoxelCell(mesh, voxel - Coord{k & 1, k >> 1 & 1, k >> 2 & 1}, k, energy, share);
    return share;
}

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

/// What a voxel counts in an average, by its offset [voxels] from the middle.
struct Weight {
    Coord offset;
    double weight;
};

std::vector<Weight> weightsWithin(double radius, double dx)
{
    const int reach = int(std::floor(radius / dx));
    std::vector<Weight> weights;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x)
                if (const double r2 = dx * dx * (x * x + y * y + z * z) / (radius * radius); r2 < 1)
                    weights.push_back({{x, y, z}, (1 - r2) * (1 - r2)});
    return weights;
}

/// The shares of all voxel nodes up to `reach` away from some: of each once, however many averages it takes part in.
tetmesh::NodeField<Share> sharesWithin(const CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels, int reach)
{
    const Coord all{reach, reach, reach};
    Coord lower = voxels.empty() ? Coord{} : voxels[0], upper = lower;
    for (const Coord& c : voxels) {
        lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
        upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
    tetmesh::NodeField<Share> shares(lower - all, upper + all, {}, {});
    for (const Coord& c : voxels)  // makes the blocks
        for (int z = (c.z - reach) & ~7; z <= c.z + reach; z += 8)
            for (int y = (c.y - reach) & ~7; y <= c.y + reach; y += 8)
                for (int x = (c.x - reach) & ~7; x <= c.x + reach; x += 8) shares.set({x, y, z}, {});
    std::vector<Coord> blocks;
    shares.forEachBlock([&](Coord low) { blocks.push_back(low); });
    parallelChunks(blocks.size(), 1, [&](std::size_t i, std::size_t) {
        for (int z = 0; z < 8; ++z)
            for (int y = 0; y < 8; ++y)
                for (int x = 0; x < 8; ++x) {
                    const Coord c = blocks[i] + Coord{x, y, z};
                    shares.set(c, shareOf(mesh, c, energy));
                }
    });
    return shares;
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

std::vector<double> nodalEnergy(const CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels)
{
    std::vector<double> psi(voxels.size());
    parallelChunks(voxels.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Share share = shareOf(mesh, voxels[i], energy);
            psi[i] = share.volume > 0 ? share.energy / share.volume : 0;
        }
    });
    return psi;
}

std::vector<double> averagedEnergy(const CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels, double radius)
{
    const int reach = int(std::floor(radius / mesh.lattice().voxelSize));
    const tetmesh::NodeField<Share> shares = sharesWithin(mesh, energy, voxels, reach);
    const std::vector<Weight> weights = weightsWithin(radius, mesh.lattice().voxelSize);
    std::vector<double> psi(voxels.size());
    parallelChunks(voxels.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Share sum;
            for (const Weight& w : weights) {
                const Share share = shares(voxels[i] + w.offset);
                sum.volume += w.weight * share.volume;
                sum.energy += w.weight * share.energy;
            }
            psi[i] = sum.volume > 0 ? sum.energy / sum.volume : 0;
        }
    });
    return psi;
}

double nodalVolume(const CutMesh& mesh, Coord voxel)
{
    return shareOf(mesh, voxel, [](std::uint32_t, int) { return 0.; }).volume;
}

}  // namespace vdbfrac::grid
