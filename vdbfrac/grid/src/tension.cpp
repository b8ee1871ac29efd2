#include <vdbfrac/grid/tension.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace vdbfrac::grid {

namespace {

using tetmesh::BodyMesh;
using tetmesh::NodeField;

/// Voxels from a node to those that are at the same tip as it.
constexpr int kNear = 3;

struct NodalStress {
    double volume = 0;      // voxels
    Mat3 S = Mat3::Zero();  // Pa
    double tension = 0;     // <s1>^2 [Pa^2]
};

/// The stresses of the elements round some voxels, each computed once.
class StressCache {
public:
    StressCache(const BodyMesh& mesh, const ElementStress& stress, std::span<const Coord> voxels)
        : number_(mesh.elements().size(), kUnseen)
    {
        std::vector<std::uint32_t> seen;
        for (const Coord& c : voxels)
            mesh.visitTets(c, [&](std::uint32_t e, int, double) {
                if (number_[e] != kUnseen) return;
                number_[e] = std::uint32_t(seen.size());
                seen.push_back(e);
            });
        stress_.resize(seen.size());
        parallelChunks(seen.size(), 32, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) stress_[i] = stress(seen[i]);
        });
    }
    const Mat3& operator()(std::uint32_t element, int tet) const { return stress_[number_[element]][std::size_t(tet)]; }

private:
    static constexpr std::uint32_t kUnseen = ~0u;
    std::vector<std::uint32_t> number_;  // by element, in stress_
    std::vector<std::array<Mat3, tetmesh::kMaxTets>> stress_;
};

NodalStress nodalStress(const BodyMesh& mesh, const StressCache& stress, Coord voxel)
{
    NodalStress node;
    mesh.visitTets(voxel, [&](std::uint32_t e, int t, double part) {
        node.volume += part;
        node.S += part * stress(e, t);
    });
    if (node.volume == 0) return node;
    node.S /= node.volume;
    const double s = std::max(0., Eigen::SelfAdjointEigenSolver<Mat3>(node.S, Eigen::EigenvaluesOnly).eigenvalues()[2]);
    node.tension = s * s;
    return node;
}

/// An empty field over some voxels and `reach` more.
template <class T>
NodeField<T> fieldAround(std::span<const Coord> voxels, int reach, T outside)
{
    Coord lower = voxels.front(), upper = lower;
    for (const Coord& c : voxels) {
        lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
        upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
    const Coord all{reach, reach, reach};
    return {lower - all, upper + all, outside, outside};
}

NodeField<NodalStress> nodalStresses(const BodyMesh& mesh, const ElementStress& stress,
                                     const std::vector<Coord>& voxels)
{
    NodeField<NodalStress> nodes = fieldAround(std::span(voxels), 0, NodalStress());
    for (const Coord& c : voxels) nodes.set(c, {});  // makes the blocks
    const StressCache cache(mesh, stress, voxels);
    parallelChunks(voxels.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) nodes.set(voxels[i], nodalStress(mesh, cache, voxels[i]));
    });
    return nodes;
}

/// C <s>^2 across d.
double across(const Mat3& S, const Vec3& d, double nu)
{
    const Vec3 Sd = S * d;
    const double along = d.dot(Sd), mean = .5 * (S.trace() - along);
    // The part of S in the plane has this sum of squares.
    const double squares = S.squaredNorm() - 2 * Sd.squaredNorm() + along * along;
    const double radius = std::sqrt(std::max(0., .5 * squares - mean * mean));
    const double s = mean + radius, t = mean - radius;
    if (s <= 0) return 0;
    const double inPlane = along + s;
    return s * s * (inPlane > 0 ? 1 - nu * std::clamp(t / inPlane, 0., nu) : 1);
}

/// A voxel node seen from the middle of a ball, which it is not: the middle lies in no direction.
struct Way {
    Coord offset;
    Vec3 direction;
    double weight;
};

std::vector<Way> waysWithin(double radius)
{
    const int reach = int(std::floor(radius));
    std::vector<Way> ways;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) {
                const Vec3 way(x, y, z);
                const double r2 = way.squaredNorm() / (radius * radius);
                if (r2 > 0 && r2 < 1) ways.push_back({{x, y, z}, way.normalized(), (1 - r2) * (1 - r2)});
            }
    return ways;
}

/// 2 E R and H [Pa^2].
struct Tension {
    double amount = 0, opening = 0;
};

Tension averaged(const NodeField<NodalStress>& nodes, const std::vector<Way>& ways, Coord voxel, double nu)
{
    const NodalStress middle = nodes(voxel);
    double volume = 0;
    Tension sum;
    for (const Way& way : ways) {
        const NodalStress node = nodes(voxel + way.offset);
        if (node.volume == 0) continue;
        const double weight = way.weight * node.volume;
        volume += weight;
        sum.amount += weight * node.tension;
        sum.opening += weight * across(node.S, way.direction, nu);
    }
    if (volume == 0) return {};
    return {(sum.amount + middle.volume * middle.tension) / (volume + middle.volume), sum.opening / volume};
}

/// Nodes in the gap beside some voxels: material round them counts for how much, as a tip may lie just before them.
/// They have no way of their own.
std::vector<Coord> gapBeside(const BodyMesh& mesh, std::span<const Coord> voxels)
{
    std::vector<Coord> gap = voxelsAround(voxels, 1);
    std::erase_if(gap, [&](const Coord& c) { return mesh.phi()(c) < 0 || mesh.phi()(c) >= mesh.voxelSize(); });
    return gap;
}

/// Psi 2 E [Pa^2] of the first `count` voxels.
std::vector<double> mostWhereItOpens(std::span<const Coord> voxels, std::span<const Tension> tension, std::size_t count)
{
    NodeField<std::int32_t> number = fieldAround(voxels, kNear, -1);
    for (std::size_t i = 0; i < voxels.size(); ++i) number.set(voxels[i], std::int32_t(i));
    std::vector<Coord> near = {{0, 0, 0}};
    for (const Way& way : waysWithin(kNear + .5)) near.push_back(way.offset);
    std::vector<double> result(count);
    for (std::size_t i = 0; i < count; ++i) {
        Tension top;
        for (const Coord& offset : near) {
            const std::int32_t n = number(voxels[i] + offset);
            if (n < 0) continue;
            const Tension& there = tension[std::size_t(n)];
            top.amount = std::max(top.amount, there.amount);
            if (std::size_t(n) < count) top.opening = std::max(top.opening, there.opening);
        }
        if (top.opening > 0) result[i] = top.amount * tension[i].opening / top.opening;
    }
    return result;
}

}  // namespace

std::vector<Coord> whereTensionMayExceed(double kappa, const BodyMesh& mesh, const TetEnergy& energy,
                                         std::span<const Coord> front, const TensionAverage& average)
{
    std::vector<Coord> hot(front.begin(), front.end());
    const std::vector<Coord> gap = gapBeside(mesh, front);
    hot.insert(hot.end(), gap.begin(), gap.end());
    // Energy is convex in stress: its average is no less than that of an average of stresses.
    const std::vector<double> psi = averagedEnergy(mesh, energy, hot, average.radius);
    const double enough = minEnergyUnder(kappa, average.poissonRatio);
    std::size_t count = 0;
    for (std::size_t i = 0; i < hot.size(); ++i)
        if (psi[i] >= enough) hot[count++] = hot[i];
    hot.resize(count);
    // What is near a hot voxel may have its tension, in proportion to the largest H near that.
    const std::vector<Coord> near = voxelsAround(hot, 2 * kNear);
    std::vector<Coord> kept;
    std::set_intersection(front.begin(), front.end(), near.begin(), near.end(), std::back_inserter(kept));
    return kept;
}

std::vector<double> averagedTension(const BodyMesh& mesh, const ElementStress& stress, std::span<const Coord> voxels,
                                    const TensionAverage& average)
{
    if (voxels.empty()) return {};
    const double radius = average.radius / mesh.voxelSize();
    std::vector<Coord> all(voxels.begin(), voxels.end());
    if (radius > 0) {
        const std::vector<Coord> gap = gapBeside(mesh, voxels);
        all.insert(all.end(), gap.begin(), gap.end());
    }
    const NodeField<NodalStress> nodes = nodalStresses(mesh, stress, voxelsAround(all, int(std::floor(radius))));
    std::vector<double> psi;
    if (radius > 0) {
        const std::vector<Way> ways = waysWithin(radius);
        std::vector<Tension> tension(all.size());
        parallelChunks(all.size(), 4, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) tension[i] = averaged(nodes, ways, all[i], average.poissonRatio);
        });
        psi = mostWhereItOpens(all, tension, voxels.size());
    } else {
        for (const Coord& c : voxels) psi.push_back(nodes(c).tension);
    }
    for (double& p : psi) p /= 2 * average.youngsModulus;
    return psi;
}

double minEnergyUnder(double tension, double nu)
{
    // Of all stresses with a largest principal one of s, that with the others at nu / (1 - nu) s has the least energy.
    return tension * (1 - 2 * nu * nu / (1 - nu));
}

int tensionReach(double radius, double voxelSize)
{
    return radius > 0 ? int(std::floor(radius / voxelSize)) + kNear : 0;
}

}  // namespace vdbfrac::grid
