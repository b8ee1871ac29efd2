#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/nodes_around.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace vdbfrac::grid {

namespace {

using tetmesh::BodyMesh;
using Share = tetmesh::NodalShare;

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
                                       int reach, const VoxelFilter& isCounted)
{
    std::vector<Coord> all = tetmesh::nodesAround(voxels, reach);
    keepIf(all, [&](const Coord& c) { return mesh.phi().contains(c) && (!isCounted || isCounted(c)); });
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
                                   double radius, const VoxelFilter& isCounted)
{
    const int reach = reachWithin(radius / mesh.voxelSize());
    const tetmesh::NodeField<Share> shares = sharesWithin(mesh, energy, voxels, reach, isCounted);
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
