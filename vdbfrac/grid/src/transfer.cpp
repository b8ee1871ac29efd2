#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <compare>
#include <iterator>

namespace vdbfrac::grid {

namespace {

using tetmesh::BodyMesh;
using Share = tetmesh::NodalShare;

/// Voxels in a row along x.
struct Row {
    int z, y, first, last;
    auto operator<=>(const Row&) const = default;
};

/// Joins sorted rows that touch.
void joinRows(std::vector<Row>& rows)
{
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

/// Sorted rows, and their copies up to `reach` away along an axis. Copies are sorted as they are: twice as many of them
/// are had each time by merging.
void widen(int Row::*axis, int reach, std::vector<Row>& rows)
{
    for (Row& row : rows) row.*axis -= reach;
    std::vector<Row> copy, merged;
    for (int width = 1; width < 2 * reach + 1;) {
        const int move = std::min(width, 2 * reach + 1 - width);
        copy = rows, merged.clear();
        for (Row& row : copy) row.*axis += move;
        std::merge(rows.begin(), rows.end(), copy.begin(), copy.end(), std::back_inserter(merged));
        joinRows(merged);
        rows.swap(merged);
        width += move;
    }
}

/// What a voxel counts in an average, by its offset [voxels] from the middle.
struct Weight {
    Coord offset;
    double weight;
};

std::vector<Weight> weightsWithin(double radius, double dx)
{
    const int reach = reachWithin(radius / dx);
    std::vector<Weight> weights;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x)
                if (const double r2 = dx * dx * (x * x + y * y + z * z) / (radius * radius); r2 < 1)
                    weights.push_back({{x, y, z}, (1 - r2) * (1 - r2)});
    return weights;
}

/// The shares of all voxel nodes up to `reach` away from some: of each once, however many averages it takes part in.
tetmesh::NodeField<Share> sharesWithin(const BodyMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels,
                                       int reach, const Counts& counts)
{
    std::vector<Coord> all = voxelsAround(voxels, reach);
    keepIf(all, [&](const Coord& c) { return mesh.phi().contains(c) && (!counts || counts(c)); });
    tetmesh::NodeField<Share> shares(mesh.phi().lower(), mesh.phi().upper(), {}, {});
    shares.cover(all);
    parallelChunks(all.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) shares.set(all[i], mesh.nodalShare(all[i], energy));
    });
    return shares;
}

}  // namespace

int reachWithin(double radius)
{
    constexpr double kRounding = 1e-9;
    return std::max(0, int(std::ceil(radius - kRounding)) - 1);
}

std::vector<Coord> voxelsAround(std::span<const Coord> voxels, int reach)
{
    // Axis by axis, on rows of voxels: as many rows as the result has, not as many voxels as all the boxes hold.
    std::vector<Row> rows;
    for (const Coord& c : voxels) rows.push_back({c.z, c.y, c.x - reach, c.x + reach});
    std::sort(rows.begin(), rows.end());
    joinRows(rows);
    widen(&Row::y, reach, rows);
    widen(&Row::z, reach, rows);
    std::vector<Coord> all;
    for (const Row& row : rows)
        for (int x = row.first; x <= row.last; ++x) all.push_back({x, row.y, row.z});
    return all;
}

std::vector<std::uint32_t> elementsRound(const BodyMesh& mesh, std::span<const Coord> voxels)
{
    std::vector<std::uint8_t> isRound(mesh.elements().size(), 0);
    parallelChunks(voxels.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            mesh.visitTets(voxels[i], [&](std::uint32_t e, int, double) {
                std::atomic_ref(isRound[e]).store(1, std::memory_order_relaxed);
            });
    });
    return gatherChunks<std::uint32_t>(isRound.size(), 4096, [&](std::size_t begin, std::size_t end, auto& found) {
        for (std::size_t e = begin; e < end; ++e)
            if (isRound[e]) found.push_back(std::uint32_t(e));
    });
}

std::vector<double> nodalEnergy(const BodyMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels)
{
    std::vector<double> psi(voxels.size());
    parallelChunks(voxels.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Share share = mesh.nodalShare(voxels[i], energy);
            psi[i] = share.volume > 0 ? share.energy / share.volume : 0;
        }
    });
    return psi;
}

VoxelValues nodalEnergies(const BodyMesh& mesh, const TetEnergy& energy)
{
    std::vector<Coord> blocks;
    mesh.phi().forEachBlock([&](Coord low) { blocks.push_back(low); });
    std::vector<VoxelValues> parts(blocks.size());
    parallelChunks(blocks.size(), 1, [&](std::size_t b, std::size_t) {
        parts[b].coords.reserve(tetmesh::NodeField<float>::kBlock),
            parts[b].scalars.reserve(tetmesh::NodeField<float>::kBlock);
        mesh.phi().forEachNode(blocks[b], [&](Coord voxel) {
            const Share share = mesh.nodalShare(voxel, energy);
            if (share.volume <= 0) return;
            parts[b].coords.push_back(voxel);
            parts[b].scalars.push_back(float(share.energy / share.volume));
        });
    });
    VoxelValues all;
    for (const VoxelValues& part : parts) {
        all.coords.insert(all.coords.end(), part.coords.begin(), part.coords.end());
        all.scalars.insert(all.scalars.end(), part.scalars.begin(), part.scalars.end());
    }
    return all;
}

std::vector<double> averagedEnergy(const BodyMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels,
                                   double radius, const Counts& counts)
{
    const int reach = reachWithin(radius / mesh.voxelSize());
    const tetmesh::NodeField<Share> shares = sharesWithin(mesh, energy, voxels, reach, counts);
    const std::vector<Weight> weights = weightsWithin(radius, mesh.voxelSize());
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

double nodalVolume(const BodyMesh& mesh, Coord voxel)
{
    return mesh.nodalShare(voxel, [](std::uint32_t, int) { return 0.; }).volume;
}

}  // namespace vdbfrac::grid
