#include <vdbfrac/skin/mean_motion.h>

#include "carrier.h"
#include "crack_lattice.h"
#include "node_search.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::skin {

namespace {

constexpr double kFrom = 0.05, kWholly = 0.15;  // voxels outside: where the mean motion begins to count, and alone does
constexpr double kRound = 1;                    // voxels farther than the nearest node with material: what is near

struct NearNode {
    Coord voxel;
    double weight = 0;
};

/// Voxel nodes with material near X that edges join to `from`, by how near they are.
std::vector<NearNode> nodesNear(const Carrier& carrier, const Vec3& X, Coord from)
{
    const Vec3 at = X / carrier.body.voxelSize();
    const auto square = [&](Coord n) { return (n.toVec() - at).squaredNorm(); };
    const double farthest = std::sqrt(square(from)) + kRound;
    const auto side = carrier.fragmentAt(from);
    std::vector<NearNode> found;
    double least = farthest * farthest;
    NodeSearch search(from);
    while (const auto n = search.next()) {
        if (!carrier.hasMaterial(*n) || carrier.fragmentAt(*n) != side) continue;
        found.push_back({*n, square(*n)});
        least = std::min(least, found.back().weight);
        forNeighbours(*n, [&](Coord next) {
            if (square(next) < farthest * farthest) search.add(next);
        });
    }
    const double radius = std::sqrt(least) + kRound;
    std::erase_if(found, [&](const NearNode& n) { return n.weight >= radius * radius; });
    for (NearNode& n : found) n.weight = std::pow(1 - std::sqrt(n.weight) / radius, 2);
    return found;
}

}  // namespace

MeanMotion::MeanMotion(const tetmesh::BodyMesh& body, std::span<const Rider> riders, const Embedded& embedded,
                       const FragmentAt& fragment, std::span<const std::uint32_t> fragmentOfNode)
{
    const Carrier carrier{body, fragment, fragmentOfNode};
    const double dx = body.voxelSize();
    for (std::uint32_t i = 0; i < riders.size(); ++i)
        if (const double out = embedded.outside[i] / dx; out > kFrom)
            points_.push_back({i, std::min(1.0, (out - kFrom) / (kWholly - kFrom))});
    std::vector<std::vector<NearNode>> near(points_.size());
    parallelChunks(points_.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            near[p] = nodesNear(carrier, riders[points_[p].rider].X, embedded.from[points_[p].rider]);
    });
    constexpr std::uint32_t kNone = 0xffffffff;
    tetmesh::NodeField<std::uint32_t> number(body.phi().lower(), body.phi().upper(), kNone, kNone);
    std::vector<Coord> voxels;
    for (const auto& list : near)
        for (const NearNode& n : list)
            if (std::uint32_t& own = number.at(n.voxel); own == kNone)
                own = std::uint32_t(voxels.size()), voxels.push_back(n.voxel);
    rounds_.resize(voxels.size());
    parallelChunks(voxels.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) rounds_[v] = round(carrier, voxels[v]);
    });
    parts_.resize(points_.size());
    for (std::size_t p = 0; p < points_.size(); ++p) {
        double sum = 0;
        parts_[p].reserve(near[p].size());
        for (const NearNode& n : near[p]) {
            const std::uint32_t round = number(n.voxel);
            const double weight = n.weight * rounds_[round].volume;
            parts_[p].push_back({round, weight, riders[points_[p].rider].X - dx * n.voxel.toVec()});
            sum += weight;
        }
        for (Part& part : parts_[p]) part.weight /= sum;
    }
}

/// The mean of the tets round a voxel node, by the material that each has there.
MeanMotion::Round MeanMotion::round(const Carrier& carrier, Coord voxel)
{
    const Vec3 X = carrier.body.voxelSize() * voxel.toVec();
    Round result;
    const std::vector<tetmesh::TetShare> tets = carrier.tetsAt(voxel);
    for (const tetmesh::TetShare& share : tets) result.volume += share.volume;
    for (const tetmesh::TetShare& share : tets) {
        const tetmesh::RestTet tet = carrier.body.restTet(share.element, std::uint32_t(share.tet));
        const tetmesh::EmbeddedPoint at = tet.embed(X);
        const double part = share.volume / result.volume;
        for (std::size_t a = 0; a < 4; ++a) {
            const Vec3 slope = a > 0 ? Vec3(tet.inverse.row(int(a) - 1)) : Vec3(-tet.inverse.colwise().sum());
            const auto same = std::ranges::find(result.terms, at.node[a], &Term::node);
            Term& term = same != result.terms.end() ? *same : result.terms.emplace_back(Term{at.node[a]});
            term.weight += part * at.weight[a], term.slope += part * slope;
        }
    }
    return result;
}

std::vector<Affine> MeanMotion::at(std::span<const Vec3> ofNodes) const
{
    std::vector<Affine> round(rounds_.size()), all(points_.size());
    parallelChunks(round.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            for (const Term& term : rounds_[v].terms) {
                round[v].value += term.weight * ofNodes[term.node];
                round[v].slope += ofNodes[term.node] * term.slope.transpose();
            }
    });
    parallelChunks(all.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            for (const Part& part : parts_[p]) {
                const Affine& near = round[part.round];
                all[p].value += part.weight * (near.value + near.slope * part.away);
                all[p].slope += part.weight * near.slope;
            }
    });
    return all;
}

}  // namespace vdbfrac::skin
