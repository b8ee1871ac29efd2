#include "settle_signs.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace vdbfrac::grid {

namespace {

using Grid = openvdb::FloatGrid;
using Leaf = Grid::TreeType::LeafNodeType;
using Voxel = openvdb::Coord;
using Side = TriangleSides::Side;

constexpr std::size_t kLeaves = 8;    // of a chunk
constexpr std::size_t kVoxels = 64;   // of a chunk
constexpr std::size_t kMany = 20000;  // voxels: with more it is quicker to look at all than at their neighbours
// Voxels: meshToVolume guesses those nearer than .75, and fills from these: of two neighbours on either side of the
// surface both are nearer than this.
constexpr float kFilled = 1;
constexpr float kOnSurface = 1e-6f;  // voxels: nearer ones are on the surface, to the rounding of floats
constexpr double kSlack = 1e-5;      // voxels: rounding of distances, which are floats
constexpr float kGap = 0.5f;         // voxels: of two neighbours with a gap between them, one is at least so near to it

Vec3 positionOf(const Voxel& c) { return {double(c.x()), double(c.y()), double(c.z())}; }

/// The 26 neighbours, and how far they are.
struct Neighbour {
    Voxel step;
    double length;
};
const std::vector<Neighbour>& neighbours()
{
    static const std::vector<Neighbour> all = [] {
        std::vector<Neighbour> n;
        for (int i = 0; i < 27; ++i)
            if (const Voxel s(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1); i != 13) n.push_back({s, positionOf(s).norm()});
        return n;
    }();
    return all;
}

const std::array<Voxel, 6> kFaces{Voxel(1, 0, 0),  Voxel(-1, 0, 0), Voxel(0, 1, 0),
                                  Voxel(0, -1, 0), Voxel(0, 0, 1),  Voxel(0, 0, -1)};

/// Calls visit(index, out) for all indices in parallel, and returns what they put out, in their order.
template <class T, class Visit>
std::vector<T> gather(std::size_t count, std::size_t chunk, const Visit& makeVisit)
{
    std::vector<std::vector<T>> parts((count + chunk - 1) / chunk);
    parallelChunks(count, chunk, [&](std::size_t begin, std::size_t end) {
        const auto visit = makeVisit();
        for (std::size_t i = begin; i < end; ++i) visit(i, parts[begin / chunk]);
    });
    std::vector<T> all;
    for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

/// What a pass reads: accessors are not shared between threads.
struct View {
    Grid::ConstAccessor phi;
    openvdb::Int32Grid::ConstAccessor closest;
    double perVoxel;  // voxels a metre

    double distance(const Voxel& c) const { return std::abs(double(phi.getValue(c))) * perVoxel; }
    bool isOutside(const Voxel& c) const { return phi.getValue(c) > 0; }
    bool hasOutsideNeighbour(const Voxel& c) const
    {
        return std::any_of(neighbours().begin(), neighbours().end(),
                           [&](const Neighbour& n) { return isOutside(c + n.step); });
    }
};

class Settler {
public:
    Settler(Grid& phi, const openvdb::Int32Grid& closest, const Triangles& triangles)
        : phi_(phi),
          closest_(closest),
          triangles_(triangles),
          sides_(triangles),
          tree_(triangles),
          dx_(phi.voxelSize()[0])
    {
        listLeaves();
    }

    std::int64_t settle()
    {
        refine();
        closeGuesses();
        std::vector<Voxel> reached = reachedAnywhere();
        while (!reached.empty()) {
            for (const Voxel& c : reached) turnOutside(c);
            reached = reached.size() > kMany ? reachedAnywhere() : reachedFrom(reached);
        }
        const std::vector<Voxel> buried = buriedVoxels();
        const std::int64_t gaps = countGaps(buried);
        if (!buried.empty()) forget(buried);
        openvdb::tools::signedFloodFillWithValues(phi_.tree(), phi_.background(), -phi_.background());
        openvdb::tools::pruneLevelSet(phi_.tree());
        return gaps;
    }

private:
    View view() const { return {phi_.getConstAccessor(), closest_.getConstAccessor(), 1 / dx_}; }
    std::uint32_t triangleAt(const View& v, const Voxel& c) const { return std::uint32_t(v.closest.getValue(c)); }
    bool isKnown(std::uint32_t triangle) const { return triangle < triangles_.corners.size(); }

    void listLeaves()
    {
        leaves_.clear();
        for (auto leaf = phi_.tree().beginLeaf(); leaf; ++leaf) leaves_.push_back(&*leaf);
    }

    /// Where meshToVolume widens its band it takes triangles that are near the closest one, which can be half a voxel
    /// off: the triangles of neighbours know better. What it put beyond the band for that comes back.
    void refine()
    {
        struct Change {
            Voxel at;
            float value;
        };
        const float far = float(dx_);
        const auto changes = gather<Change>(leaves_.size(), kLeaves, [&] {
            return [&, v = view()](std::size_t i, std::vector<Change>& out) {
                for (auto at = leaves_[i]->cbeginValueOn(); at; ++at) {
                    if (std::abs(*at) <= far) continue;
                    const float nearer = float(distanceByNeighbours(v, at.getCoord(), std::abs(*at)) * dx_);
                    if (nearer < std::abs(*at)) out.push_back({at.getCoord(), std::copysign(nearer, *at)});
                    for (const Voxel& step : kFaces)
                        if (const Voxel beside = at.getCoord() + step; !v.phi.isValueOn(beside)) {
                            const float value = v.phi.getValue(beside), edge = std::abs(value);
                            const float found = float(distanceByNeighbours(v, beside, edge) * dx_);
                            if (found < edge) out.push_back({beside, std::copysign(found, value)});
                        }
                }
            };
        });
        for (const Change& c : changes) phi_.tree().setValueOn(c.at, c.value);
        listLeaves();
    }

    /// The least distance [voxels] to the triangles of those neighbours that are nearer to the surface.
    double distanceByNeighbours(const View& v, const Voxel& c, float own) const
    {
        double nearest = own / dx_;
        std::uint32_t last = triangleAt(v, c);
        for (const Voxel& step : kFaces) {
            const std::uint32_t n = triangleAt(v, c + step);
            if (n == last || !isKnown(n) || !(std::abs(v.phi.getValue(c + step)) < own)) continue;
            nearest = std::min(nearest, (closestPoint(triangles_, n, positionOf(c)).at - positionOf(c)).norm());
            last = n;
        }
        return nearest;
    }

    /// All that meshToVolume only guessed becomes inside, and so does what lies on the surface, and what the triangles
    /// have inside: one voxel that is outside by mistake would let all others out.
    void closeGuesses()
    {
        const float near = kFilled * float(dx_), least = kOnSurface * float(dx_);
        parallelChunks(leaves_.size(), kLeaves, [&](std::size_t begin, std::size_t end) {
            for (const View seen = view(); begin < end; ++begin)
                for (auto v = leaves_[begin]->beginValueOn(); v; ++v)
                    if (*v > -least && (*v <= near || sideOf(seen, v.getCoord()) == Side::inside))
                        v.setValue(-std::max(std::abs(*v), least));
        });
    }

    void turnOutside(const Voxel& c)
    {
        Leaf* leaf = phi_.tree().probeLeaf(c);
        leaf->setValueOnly(c, -leaf->getValue(c));
    }

    Side sideOf(const View& v, const Voxel& c) const
    {
        const std::uint32_t n = triangleAt(v, c);
        return isKnown(n) ? sides_.sideOf(positionOf(c), n) : Side::unknown;
    }

    /// Can a voxel that is not known to be outside be reached from a neighbour that is?
    bool isReached(const View& v, const Voxel& c) const
    {
        const double d = v.distance(c);
        if (d < 2 * kOnSurface) return false;
        const Neighbour* best = nullptr;
        double farthest = 0;
        for (const Neighbour& n : neighbours()) {
            if (!v.isOutside(c + n.step)) continue;
            const double other = v.distance(c + n.step);
            if (d + other > n.length + kSlack) return true;  // balls without surface in them overlap
            if (other >= farthest) best = &n, farthest = other;
        }
        return best && hasFreeWay(v, c, c + best->step);
    }

    bool isFree(const Voxel& from, const Voxel& to) const { return !tree_.isCrossed(positionOf(from), positionOf(to)); }

    /// A way to a neighbour outside that crosses nothing. When the pseudonormal calls the voxel inside, as it rightly
    /// does but where a surface is turned inside out, the way to `likely` decides in most cases, and one that rounding
    /// lets through is not enough.
    bool hasFreeWay(const View& v, const Voxel& c, const Voxel& likely) const
    {
        const bool isDoubted = sideOf(v, c) == Side::inside;
        if (isDoubted && !isFree(c, likely)) return false;
        int missing = isDoubted ? 2 : 1;
        for (const Neighbour& n : neighbours())
            if (v.isOutside(c + n.step) && isFree(c, c + n.step) && --missing == 0) return true;
        return false;
    }

    std::vector<Voxel> reachedAnywhere() const
    {
        return gather<Voxel>(leaves_.size(), kLeaves, [&] {
            return [&, v = view()](std::size_t i, std::vector<Voxel>& out) {
                for (auto at = leaves_[i]->cbeginValueOn(); at; ++at)
                    if (*at <= 0 && isReached(v, at.getCoord())) out.push_back(at.getCoord());
            };
        });
    }

    std::vector<Voxel> reachedFrom(const std::vector<Voxel>& reached) const
    {
        std::vector<Voxel> candidates = gather<Voxel>(reached.size(), kVoxels, [&] {
            return [&, v = view()](std::size_t i, std::vector<Voxel>& out) {
                for (const Neighbour& n : neighbours())
                    if (const Voxel c = reached[i] + n.step; !v.isOutside(c) && v.phi.isValueOn(c)) out.push_back(c);
            };
        });
        sortUnique(candidates);
        return gather<Voxel>(candidates.size(), kVoxels, [&] {
            return [&, v = view()](std::size_t i, std::vector<Voxel>& out) {
                if (isReached(v, candidates[i])) out.push_back(candidates[i]);
            };
        });
    }

    /// Voxels close to a surface that has no outside beside it. Sorted.
    std::vector<Voxel> buriedVoxels() const
    {
        const float near = kGap * float(dx_);
        std::vector<Voxel> buried = gather<Voxel>(leaves_.size(), kLeaves, [&] {
            return [&, v = view()](std::size_t i, std::vector<Voxel>& out) {
                for (auto at = leaves_[i]->cbeginValueOn(); at; ++at)
                    if (*at <= 0 && *at >= -near && !v.hasOutsideNeighbour(at.getCoord())) out.push_back(at.getCoord());
            };
        });
        std::sort(buried.begin(), buried.end());
        return buried;
    }

    std::int64_t countGaps(const std::vector<Voxel>& buried) const
    {
        return std::int64_t(orderedSum(buried.size(), kVoxels, [&](std::size_t begin, std::size_t end) {
            double gaps = 0;
            for (std::size_t i = begin; i < end; ++i)
                for (int a = 0; a < 6; ++a) {
                    Voxel other = buried[i];
                    other[a / 2] += a % 2 ? 1 : -1;
                    const bool isTwice = other < buried[i] && std::binary_search(buried.begin(), buried.end(), other);
                    gaps += !isTwice && hasGap(buried[i], other);
                }
            return gaps;
        }));
    }

    /// Does the way between two voxels inside leave the material and enter it again? Where shells overlap it enters one
    /// before it leaves the other.
    bool hasGap(const Voxel& from, const Voxel& to) const
    {
        bool hasLeft = false;
        double left = 0;
        for (const TriangleTree::Crossing& c : tree_.crossings(positionOf(from), positionOf(to))) {
            const bool leaves = c.alongNormal == sides_.isOutward(c.triangle);
            if (hasLeft && c.t - left > kSlack && (!leaves || !sides_.hasSides(c.triangle))) return true;
            if (!hasLeft && (leaves || !sides_.hasSides(c.triangle))) hasLeft = true, left = c.t;
        }
        return false;
    }

    /// Voxels inside whose closest triangle is buried get their distance to one that is not: from the triangles of
    /// their neighbours, as meshToVolume widens its band.
    void forget(const std::vector<Voxel>& buried);
    std::vector<Voxel> voxelsNear(const std::vector<Voxel>& buried) const;
    bool isBuried(const View& v, const Voxel& c) const;
    struct Found {
        std::uint32_t triangle;
        double distance;
    };
    Found nearestOfNeighbours(const Voxel& c, Grid::ConstAccessor& phi, openvdb::Int32Grid::ConstAccessor& known) const;

    Grid& phi_;
    const openvdb::Int32Grid& closest_;
    const Triangles& triangles_;
    const TriangleSides sides_;
    const TriangleTree tree_;
    const double dx_;
    std::vector<Leaf*> leaves_;
};

/// Is the part of the surface closest to a voxel inside without outside beside it?
bool Settler::isBuried(const View& v, const Voxel& c) const
{
    const std::uint32_t n = triangleAt(v, c);
    if (!isKnown(n)) return true;
    const Vec3 at = closestPoint(triangles_, n, positionOf(c)).at;
    const Voxel beside(int(std::lround(at.x())), int(std::lround(at.y())), int(std::lround(at.z())));
    return !v.isOutside(beside) && !v.hasOutsideNeighbour(beside);
}

/// Voxels inside, in the leaves that the band of a buried surface can reach, whose closest triangle is buried.
std::vector<Voxel> Settler::voxelsNear(const std::vector<Voxel>& buried) const
{
    const int reach = int(std::ceil(phi_.background() / dx_)) + 1;
    std::vector<Voxel> origins;
    openvdb::CoordBBox last;  // those of a voxel are mostly those of the one before
    for (const Voxel& c : buried) {
        const openvdb::CoordBBox leaves((c - Voxel(reach)) >> 3, (c + Voxel(reach)) >> 3);
        if (leaves == last) continue;
        last = leaves;
        for (auto o = leaves.begin(); o; ++o) origins.push_back(*o << 3);
    }
    sortUnique(origins);
    return gather<Voxel>(origins.size(), kLeaves, [&] {
        return [&, v = view()](std::size_t i, std::vector<Voxel>& out) {
            const Leaf* leaf = phi_.constTree().probeConstLeaf(origins[i]);
            if (!leaf) return;
            for (auto at = leaf->cbeginValueOn(); at; ++at)
                if (*at <= 0 && isBuried(v, at.getCoord())) out.push_back(at.getCoord());
        };
    });
}

Settler::Found Settler::nearestOfNeighbours(const Voxel& c, Grid::ConstAccessor& phi,
                                            openvdb::Int32Grid::ConstAccessor& known) const
{
    Found best{~0u, phi_.background() / dx_};
    for (const Neighbour& n : neighbours()) {
        const Voxel other = c + n.step;
        if (!phi.isValueOn(other) || phi.getValue(other) > 0) continue;
        const std::uint32_t triangle = std::uint32_t(known.getValue(other));
        if (!isKnown(triangle)) continue;
        const double d = (closestPoint(triangles_, triangle, positionOf(c)).at - positionOf(c)).norm();
        if (d < best.distance || (d == best.distance && triangle < best.triangle)) best = {triangle, d};
    }
    return best;
}

void Settler::forget(const std::vector<Voxel>& buried)
{
    const std::vector<Voxel> voxels = voxelsNear(buried);
    const openvdb::Int32Grid::Ptr known = closest_.deepCopy();
    auto phi = phi_.getAccessor();
    auto triangles = known->getAccessor();
    for (const Voxel& c : voxels) {
        phi.setValueOff(c, -phi_.background());
        triangles.setValueOff(c, closest_.background());
    }
    const int rounds = 2 * int(std::ceil(phi_.background() / dx_)) + 1;
    for (int round = 0; round < rounds; ++round) {
        std::vector<Found> found(voxels.size());
        parallelChunks(voxels.size(), kVoxels, [&](std::size_t begin, std::size_t end) {
            auto values = phi_.getConstAccessor();
            auto numbers = known->getConstAccessor();
            for (std::size_t i = begin; i < end; ++i) found[i] = nearestOfNeighbours(voxels[i], values, numbers);
        });
        bool changed = false;
        for (std::size_t i = 0; i < voxels.size(); ++i) {
            const float value = float(-found[i].distance * dx_);
            if (!isKnown(found[i].triangle) || value <= phi.getValue(voxels[i])) continue;
            phi.setValueOn(voxels[i], value);
            triangles.setValueOn(voxels[i], std::int32_t(found[i].triangle));
            changed = true;
        }
        if (!changed) break;
    }
}

}  // namespace

std::int64_t settleSigns(openvdb::FloatGrid& phi, const openvdb::Int32Grid& closest, const Triangles& triangles)
{
    return phi.activeVoxelCount() == 0 ? 0 : Settler(phi, closest, triangles).settle();
}

}  // namespace vdbfrac::grid
