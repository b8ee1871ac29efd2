#include <vdbfrac/skin/mean_motion.h>

#include "carrier.h"
#include "crack_lattice.h"
#include "node_search.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::skin {

namespace {

constexpr double kFrom = 0.05, kWholly = 0.15;  // voxels outside: where the mean motion begins to count, and alone does
constexpr double kAlike = 0.5;                  // of neighbours' motions that may differ
constexpr int kPasses = 4;                      // over what is evened out
constexpr double kRound = 1;                    // voxels farther than the nearest node with material: what is near

/// Edges from one voxel node to another where nothing is in the way: they lead along diagonals of one kind only.
int edgesTo(Coord d) { return std::max({0, d.x, d.y, d.z}) + std::max({0, -d.x, -d.y, -d.z}); }

/// Voxel nodes with material that edges outside of cracks join to `from`, near X: no farther than `from` and kRound
/// more. What is reached by a detour only, round the front of a crack or through a ligament, is on the other lip.
std::vector<Coord> nodesNear(const Carrier& carrier, const CrackField& cracks, const Vec3& X, Coord from)
{
    const Vec3 at = X / carrier.body.voxelSize();
    const auto square = [&](Coord n) { return (n.toVec() - at).squaredNorm(); };
    const double farthest = std::pow(std::sqrt(square(from)) + kRound, 2);
    std::vector<Coord> found;
    NodeSearch search(from);
    const auto counts = [&](Coord n) {
        return carrier.hasMaterial(n) && !(cracks.c(n) > 0) && search.steps() <= edgesTo(n - from);
    };
    while (const auto n = search.next()) {
        if (*n != from && !counts(*n)) continue;
        found.push_back(*n);
        forNeighbours(*n, [&](Coord next) {
            if (square(next) < farthest) search.add(next);
        });
    }
    return found;
}

}  // namespace

MeanMotion::MeanMotion(const tetmesh::BodyMesh& body, const CrackField& cracks, std::span<const Rider> riders,
                       const Embedded& embedded, const FragmentAt& fragment,
                       std::span<const std::uint32_t> fragmentOfNode)
{
    const Carrier carrier{body, fragment, fragmentOfNode};
    for (std::uint32_t i = 0; i < riders.size(); ++i)
        if (const double out = embedded.outside[i] / body.voxelSize(); out > kFrom)
            points_.push_back({i, riders[i].X, embedded.outside[i], std::min(1.0, (out - kFrom) / (kWholly - kFrom))});
    std::vector<std::vector<Coord>> near(points_.size());  // first that at which material was found
    parallelChunks(points_.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            near[p] = nodesNear(carrier, cracks, points_[p].X, embedded.from[points_[p].rider]);
    });
    constexpr std::uint32_t kNone = 0xffffffff;
    tetmesh::NodeField<std::uint32_t> number(body.phi().lower(), body.phi().upper(), kNone, kNone);
    std::vector<Coord> voxels;
    for (const auto& list : near)
        for (const Coord& n : list)
            if (std::uint32_t& own = number.at(n); own == kNone)
                own = std::uint32_t(voxels.size()), voxels.push_back(n);
    rounds_.resize(voxels.size());
    parallelChunks(voxels.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) rounds_[v] = round(carrier, voxels[v]);
    });
    parts_.resize(points_.size());
    parallelChunks(points_.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            for (const Coord& n : near[p]) parts_[p].push_back({number(n), 0});
            weigh(points_[p], parts_[p], body.voxelSize());
        }
    });
}

/// Gives a point the voxel nodes of the fragment of the first, the nearer and the more material is round them the more.
void MeanMotion::weigh(Point& point, Parts& parts, double dx) const
{
    const auto distance = [&](const Part& part) { return (point.X - rounds_[part.round].X).norm() / dx; };
    std::erase_if(
        parts, [&, side = rounds_[parts[0].round].side](const Part& part) { return rounds_[part.round].side != side; });
    for (Part& part : parts) part.weight = distance(part);
    const double radius = kRound + std::ranges::min(parts, {}, &Part::weight).weight;
    std::erase_if(parts, [&](const Part& part) { return part.weight >= radius; });
    double sum = 0;
    for (Part& part : parts) {
        part.weight = std::pow(1 - part.weight / radius, 2) * rounds_[part.round].volume;
        sum += part.weight;
    }
    if (!(sum > 0)) parts.clear(), point.share = 0;
    for (Part& part : parts) part.weight /= sum;
    std::ranges::sort(parts, {}, &Part::round);
}

/// How much of two motions is the same: from 0 to 1.
double MeanMotion::common(const Parts& a, const Parts& b)
{
    double sum = 0;
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
        if (a[i].round == b[j].round) sum += std::min(a[i].weight, b[j].weight);
        const bool first = a[i].round <= b[j].round, second = b[j].round <= a[i].round;
        i += first, j += second;
    }
    return sum;
}

void MeanMotion::evenOut(std::vector<std::array<std::uint32_t, 2>> edges)
{
    std::erase_if(edges, [&](const auto& edge) { return parts_[edge[0]].empty() || parts_[edge[1]].empty(); });
    std::vector<std::uint8_t> uneven(edges.size());
    parallelChunks(edges.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) uneven[e] = common(parts_[edges[e][0]], parts_[edges[e][1]]) < kAlike;
    });
    std::vector<std::uint32_t> ends;
    for (std::size_t e = 0; e < edges.size(); ++e)
        if (uneven[e]) ends.insert(ends.end(), edges[e].begin(), edges[e].end());
    sortUnique(ends);
    const auto placeOf = [&](std::uint32_t p) { return std::size_t(std::ranges::lower_bound(ends, p) - ends.begin()); };
    std::vector<std::vector<std::uint32_t>> beside(ends.size());
    for (const auto& [a, b] : edges)
        for (const auto& [own, other] : {std::pair(a, b), std::pair(b, a)})
            if (const std::size_t i = placeOf(own); i < ends.size() && ends[i] == own) beside[i].push_back(other);
    for (std::vector<std::uint32_t>& list : beside) sortUnique(list);
    for (int pass = 0; pass < kPasses; ++pass) {
        std::vector<Parts> next(ends.size());
        parallelChunks(ends.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) next[i] = mixed(ends[i], beside[i]);
        });
        for (std::size_t i = 0; i < ends.size(); ++i) parts_[ends[i]] = std::move(next[i]);
    }
}

/// Half of a point's motion and half of the mean of those beside it.
MeanMotion::Parts MeanMotion::mixed(std::uint32_t point, std::span<const std::uint32_t> beside) const
{
    Parts all = parts_[point];
    for (Part& part : all) part.weight *= 0.5;
    for (const std::uint32_t other : beside)
        for (const Part& part : parts_[other]) all.push_back({part.round, 0.5 * part.weight / double(beside.size())});
    std::ranges::stable_sort(all, {}, &Part::round);
    Parts parts;
    for (const Part& part : all) {
        if (parts.empty() || parts.back().round != part.round) parts.push_back({part.round, 0});
        parts.back().weight += part.weight;
    }
    return parts;
}

/// The mean of the tets round a voxel node, by the material that each has there.
MeanMotion::Round MeanMotion::round(const Carrier& carrier, Coord voxel)
{
    Round result;
    result.X = carrier.body.voxelSize() * voxel.toVec();
    result.side = carrier.fragmentAt(voxel);
    if (carrier.fragment && !result.side) return result;  // of whatever side: beside its tets
    const std::vector<tetmesh::TetShare> tets = carrier.tetsAt(voxel, result.side);
    for (const tetmesh::TetShare& share : tets) result.volume += share.volume;
    for (const tetmesh::TetShare& share : tets) {
        if (!(share.volume > 0)) continue;
        const tetmesh::RestTet tet = carrier.body.restTet(share.element, std::uint32_t(share.tet));
        const tetmesh::EmbeddedPoint at = tet.embed(result.X);
        const double part = share.volume / result.volume;
        for (std::size_t a = 0; a < 4; ++a) {
            const auto same = std::ranges::find(result.terms, at.node[a], &Term::node);
            Term& term = same != result.terms.end() ? *same : result.terms.emplace_back(Term{at.node[a]});
            term.weight += part * at.weight[a], term.gradient += part * tet.gradient(a);
        }
    }
    return result;
}

std::vector<Vec3> MeanMotion::at(std::span<const Vec3> ofNodes) const
{
    struct Affine {
        Vec3 value = Vec3::Zero();
        Mat3 gradient = Mat3::Zero();  // by the place at rest
    };
    std::vector<Affine> round(rounds_.size());
    std::vector<Vec3> all(points_.size(), Vec3::Zero());
    parallelChunks(round.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            for (const Term& term : rounds_[v].terms) {
                round[v].value += term.weight * ofNodes[term.node];
                round[v].gradient += ofNodes[term.node] * term.gradient.transpose();
            }
    });
    parallelChunks(all.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            for (const Part& part : parts_[p]) {
                const Affine& near = round[part.round];
                all[p] += part.weight * (near.value + near.gradient * (points_[p].X - rounds_[part.round].X));
            }
    });
    return all;
}

}  // namespace vdbfrac::skin
