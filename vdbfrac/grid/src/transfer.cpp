#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::grid {

namespace {

using tetmesh::Cell;
using tetmesh::CellShape;
using tetmesh::CutMesh;
using tetmesh::kMostTets;
using tetmesh::Piece;

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

}  // namespace

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
