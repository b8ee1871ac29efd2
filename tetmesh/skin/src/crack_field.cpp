#include <vdbfrac/skin/crack_field.h>

#include "crack_lattice.h"
#include "node_search.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/nodes_around.h>
#include <vdbfrac/tetmesh/nodes_where.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

using Field = tetmesh::NodeField<float>;
using Sides = std::vector<std::pair<Coord, Coord>>;

constexpr double kFar = 3;          // voxels: nothing is known of cracks that are farther
constexpr double kNear = 1.5;       // voxels from a crack that its surface may need the values of
constexpr double kBeside = 0.5;     // voxels from a crack within which c tells which node is nearer
constexpr double kTorn = 1e-3;      // voxels: by rounding it may rise as much
constexpr double kOpened = 0.05;    // voxels: c of a node that has to be open
constexpr double kSmoothed = 0.25;  // share of the neighbours: half of it makes a crack of two voxels a third thinner
constexpr float kNotRaised = std::numeric_limits<float>::infinity();
constexpr int kReach = 3;  // voxels over which known values are carried on
constexpr int kWay = 24;   // edges from a node to its material: along a rim that a crack has eaten it is far

/// Calls visit(offset) for the nodes of a cube round one.
template <class Visit>
void forOffsets(int reach, const Visit& visit)
{
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) visit(Coord{x, y, z});
}

class Extension {
public:
    Extension(const Field& rest, const Field& now, double dx, const FragmentAt& fragment,
              std::span<const Coord> between)
        : rest_(rest),
          now_(now),
          dx_(dx),
          fragment_(fragment),
          between_(between),
          raised_(rest.lower(), rest.upper(), kNotRaised, kNotRaised),
          c_(rest.lower(), rest.upper(), float(-kFar * dx), float(-kFar * dx))
    {
    }

    CrackField run()
    {
        const std::vector<Coord> known = raisedNodes();
        for (Coord n : known) raised_.set(n, now_(n)), c_.set(n, now_(n));
        carryInside(known);
        smooth(near_, [&](Coord n, double smooth) { return settled(n, smooth); });
        if (fragment_) openBetweenFragments();
        const std::vector<Coord> outside = carryOutside();
        Sides side = keepApart(bareNodes(outside));
        smooth(outside, [&](Coord n, double smooth) { return (smooth > 0) == (c_(n) > 0) ? off(smooth) : c_(n); });
        return {std::move(c_), std::move(side)};
    }

private:
    /// As the lattice is cut: a node on the surface is outside, whatever the last bits of its phi are.
    bool isBelow(double phi) const { return phi < -tetmesh::kSnap * dx_; }
    bool isInside(Coord n) const { return isBelow(rest_(n)); }
    bool isRaised(Coord n) const { return raised_(n) < kNotRaised; }
    bool hasRisen(Coord n) const { return now_(n) > rest_(n) + kRaised * dx_; }

    /// The nodes inside, at rest, whose phi a crack has raised: by more than re-levelling may do to what did not tear;
    /// or a little, beside what did.
    std::vector<Coord> raisedNodes() const
    {
        return tetmesh::nodesWhere(now_, [&](Coord n) {
            if (!isInside(n) || !(now_(n) > rest_(n) + kTorn * dx_)) return false;
            if (hasRisen(n)) return true;
            bool beside = false;
            if (now_(n) >= 0)
                forNeighbours(n, [&](Coord m) { beside = beside || (isInside(m) && now_(m) >= 0 && hasRisen(m)); });
            return beside;
        });
    }

    /// Nodes round those near a crack for which `wanted` holds, sorted.
    template <class Wanted>
    std::vector<Coord> nodesRound(std::vector<Coord> nodes, int reach, const Wanted& wanted) const
    {
        keepIf(nodes, [&](Coord n) { return c_(n) > -kNear * dx_; });
        std::vector<Coord> round = tetmesh::nodesAround(nodes, reach);
        keepIf(round, [&](Coord n) { return c_.contains(n) && wanted(n); });
        return round;
    }

    /// Inside, where phi is as it was: midway between the least and the greatest function through the known values
    /// that changes no faster than distances do, and no more than phi.
    void carryInside(const std::vector<Coord>& known)
    {
        near_ = nodesRound(known, 2, [&](Coord n) { return isInside(n) && !isRaised(n); });
        std::vector<float> value(near_.size());
        parallelChunks(near_.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) value[i] = float(between(near_[i]));
        });
        for (std::size_t i = 0; i < near_.size(); ++i) c_.set(near_[i], value[i]);
        near_.insert(near_.end(), known.begin(), known.end());
    }
    double between(Coord n) const
    {
        double low = -kFar * dx_, high = kFar * dx_;
        forOffsets(kReach, [&](Coord d) {
            if (!isRaised(n + d)) return;
            const double value = raised_(n + d), distance = dx_ * d.toVec().norm();
            low = std::max(low, value - distance), high = std::min(high, value + distance);
        });
        const double middle = 0.5 * (low + high);
        return now_(n) < 0 ? std::min<double>(middle, now_(n)) : middle;
    }

    /// Outside, the value one voxel below the closest point of the skin. Returns the nodes.
    std::vector<Coord> carryOutside()
    {
        std::vector<Coord> outside =
            nodesRound(near_, kReach, [&](Coord n) { return !isInside(n) && rest_(n) < kBeyond * dx_; });
        std::vector<float> value(outside.size());
        parallelChunks(outside.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Coord n = outside[i];
                const std::optional<Vec3> up = uphill(n);
                const auto below = up ? inside(n.toVec() - (rest_(n) / dx_ + 1) * *up) : std::nullopt;
                value[i] = below ? float(off(*below)) : c_(n);
            }
        });
        for (std::size_t i = 0; i < outside.size(); ++i) c_.set(outside[i], value[i]);
        closeBubbles(outside);
        return outside;
    }
    /// Outside, cracks only go on: closes what is open there and not joined to what is open inside.
    void closeBubbles(const std::vector<Coord>& outside)
    {
        std::vector<Coord> open;
        for (Coord n : outside)
            if (c_(n) > 0) open.push_back(n);
        std::set<Coord> joined;
        const auto joins = [&](Coord n) {
            bool any = false;
            forNeighbours(n, [&](Coord m) { any = any || (c_(m) > 0 && (isInside(m) || joined.contains(m))); });
            return any && joined.insert(n).second;
        };
        while (std::erase_if(open, joins) > 0) {}
        for (Coord n : open) c_.set(n, float(-kLeast * dx_));
    }
    /// c at a place [voxels], from those corners of its voxel that are inside: near an edge of the skin not all are.
    std::optional<double> inside(const Vec3& at) const
    {
        const Coord low = tetmesh::floorOf(at);
        const Vec3 t = at - low.toVec();
        double sum = 0, all = 0;
        for (int k = 0; k < tetmesh::kCorners; ++k) {
            const Coord n = low + tetmesh::cornerOffset(k);
            const double share = isInside(n) ? tetmesh::trilinearShare(k, t) : 0;
            sum += share * c_(n), all += share;
        }
        return all > 0 ? std::optional(sum / all) : std::nullopt;
    }
    /// Nodes near cracks that have no material and are in no crack: those outside, and those under the skin whose phi
    /// rose past 0 by too little to tell a crack by, near one or not; and those between parts.
    std::vector<Coord> bareNodes(std::vector<Coord> nodes) const
    {
        for (Coord n : near_)
            if (isBare(n)) nodes.push_back(n);
        nodes.insert(nodes.end(), between_.begin(), between_.end());
        const std::vector<Coord> lost = tetmesh::nodesWhere(
            now_, [&](Coord n) { return isInside(n) && !isBelow(now_(n)) && !(c_(n) > float(-kFar * dx_)); });
        for (Coord n : tetmesh::nodesAround(lost, kReach))
            if (c_.contains(n) && isBare(n) && rest_(n) < kBeyond * dx_) nodes.push_back(n);
        sortUnique(nodes);
        return nodes;
    }
    /// Has it material that is drawn?
    bool isMaterial(Coord n) const { return isBelow(now_(n)) && !(c_(n) > 0); }
    bool isBare(Coord n) const { return !isBelow(now_(n)) && !(c_(n) > 0); }

    /// Opens nodes with material where an edge leads to another fragment: of both the one nearer to a crack.
    void openBetweenFragments()
    {
        std::vector<Coord> nodes;
        for (Coord n : near_)
            if (isMaterial(n) && c_(n) > -kNear * dx_) nodes.push_back(n);
        std::sort(nodes.begin(), nodes.end());
        std::vector<std::optional<std::uint32_t>> fragment(nodes.size());
        parallelChunks(nodes.size(), 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) fragment[i] = fragment_(nodes[i]);
        });
        const auto of = [&](Coord n) {
            const auto at = std::lower_bound(nodes.begin(), nodes.end(), n);
            return at != nodes.end() && *at == n ? fragment[std::size_t(at - nodes.begin())] : fragment_(n);
        };
        for (std::size_t i = 0; i < nodes.size(); ++i)
            forNeighbours(nodes[i], [&](Coord m) {
                if (!isMaterial(nodes[i]) || !isMaterial(m) || of(m) == fragment[i]) return;
                c_.set(c_(m) > c_(nodes[i]) ? m : nodes[i], float(kOpened * dx_));
            });
    }

    /// Direction in which phi rises at rest.
    std::optional<Vec3> uphill(Coord n) const
    {
        const auto slope = [&](Coord d) { return double(rest_(n + d)) - double(rest_(n - d)); };
        const Vec3 g(slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1}));
        const double length = g.norm();
        if (!(length > 0)) return std::nullopt;
        return g / length;
    }
    /// Takes off what is left of the voxels: mixes each value with the mean of its neighbours, as `settle` allows it.
    template <class Settle>
    void smooth(const std::vector<Coord>& nodes, const Settle& settle)
    {
        constexpr Coord kAxes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        std::vector<float> value(nodes.size());
        parallelChunks(nodes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                double sum = 0;
                for (Coord d : kAxes) sum += double(c_(nodes[i] + d)) + double(c_(nodes[i] - d));
                value[i] = float(settle(nodes[i], (1 - kSmoothed) * c_(nodes[i]) + kSmoothed * sum / 6));
            }
        });
        for (std::size_t i = 0; i < nodes.size(); ++i) c_.set(nodes[i], value[i]);
    }
    /// Material stays, and what was torn stays torn.
    double settled(Coord n, double smooth) const
    {
        const double before = c_(n);
        if (isBelow(now_(n))) return std::min(smooth < 0 ? smooth : before, -kLeast * dx_);
        if (isRaised(n)) return std::max(smooth > 0 ? smooth : before, kLeast * dx_);
        return off(smooth);
    }
    /// A value as far from 0 as it has to be.
    double off(double c) const { return c < 0 ? std::min(c, -kLeast * dx_) : std::max(c, kLeast * dx_); }

    /// Opens nodes without material where they would hold together what the crack has parted: a crack much thinner
    /// than a voxel is lost between the nodes. Returns the nearest material of the others.
    Sides keepApart(const std::vector<Coord>& bare)
    {
        Sides side;
        std::vector<std::optional<Coord>> found(bare.size());
        std::vector<std::uint32_t> stale(bare.size());  // what the last round may have changed
        std::iota(stale.begin(), stale.end(), 0u);
        while (!stale.empty()) {
            std::vector<Coord> nodes;
            for (const std::uint32_t i : stale) nodes.push_back(bare[i]);
            const std::vector<std::optional<Coord>> material = materialFrom(nodes);
            for (std::size_t i = 0; i < stale.size(); ++i) found[stale[i]] = material[i];
            side.clear();
            for (std::size_t i = 0; i < bare.size(); ++i)
                if (found[i]) side.emplace_back(bare[i], *found[i]);
            std::vector<Coord> opened;
            for (Coord n : bridgesOf(bare, stale, side))
                if (isBridge(n, side)) c_.set(n, float(kOpened * dx_)), opened.push_back(n);
            stale = nodesNear(bare, opened);
        }
        return side;
    }
    /// Which of the nodes are so near to others that what searches find there may be another thing: their blocks touch.
    static std::vector<std::uint32_t> nodesNear(const std::vector<Coord>& nodes, std::span<const Coord> others)
    {
        static constexpr double kBlock = kWay + 2;  // nodes: ways and the neighbours of their ends reach no farther
        const auto blockOf = [](Coord n) { return tetmesh::floorOf(n.toVec() / kBlock); };
        std::set<Coord> blocks;
        for (Coord n : others) forOffsets(1, [&](Coord d) { blocks.insert(blockOf(n) + d); });
        std::vector<std::uint32_t> near;
        for (std::uint32_t i = 0; i < nodes.size() && !blocks.empty(); ++i)
            if (blocks.contains(blockOf(nodes[i]))) near.push_back(i);
        return near;
    }
    /// Nodes between material that is apart: those nearest to a crack first, then, where none is near, as in a slit
    /// behind its front, those farthest from the skin, which opening them cuts only where it goes round several parts.
    std::vector<Coord> bridgesOf(const std::vector<Coord>& bare, std::span<const std::uint32_t> which,
                                 const Sides& side) const
    {
        std::vector<Coord> nodes;
        for (const std::uint32_t i : which) nodes.push_back(bare[i]);
        keepIf(nodes, [&](Coord n) { return !(c_(n) > 0) && isBridge(n, side); });
        const auto order = [&](Coord n) {
            const bool cutsSkin = std::ranges::binary_search(between_, n);
            return std::pair(std::max<double>(c_(n), -kBeside * dx_), cutsSkin ? 0 : rest_(n));
        };
        std::stable_sort(nodes.begin(), nodes.end(), [&](Coord a, Coord b) { return order(a) > order(b); });
        return nodes;
    }
    bool isBridge(Coord n, const Sides& side) const
    {
        const std::optional<Coord> own = sideOf(n, side);
        if (!own) return false;
        bool bridge = false;
        forNeighbours(n, [&](Coord m) {
            if (bridge || c_(m) > 0) return;
            const std::optional<Coord> other = sideOf(m, side);
            bridge = other && *other != *own && !areJoined(*own, *other, [&](Coord k) { return isMaterial(k); });
        });
        return bridge;
    }
    std::optional<Coord> sideOf(Coord n, const Sides& side) const
    {
        if (isMaterial(n)) return n;
        const auto at = std::lower_bound(side.begin(), side.end(), n,
                                         [](const auto& entry, Coord key) { return entry.first < key; });
        return at != side.end() && at->first == n ? std::optional(at->second) : std::nullopt;
    }
    /// Of nodes without material the nearest with some that edges lead to without entering a crack; of nodes in a crack
    /// none. From the material outwards: the first neighbour that is one step nearer to some leads there.
    std::vector<std::optional<Coord>> materialFrom(std::span<const Coord> nodes) const
    {
        constexpr int kAround = 4;  // nodes
        constexpr std::uint32_t kNone = ~0u;
        const auto isClosed = [&](Coord n) { return holdsTogether(c_(n), rest_(n), dx_); };
        std::vector<Coord> air = tetmesh::nodesAround(nodes, kAround);
        keepIf(air, [&](Coord n) { return c_.contains(n) && isClosed(n) && !isMaterial(n); });
        tetmesh::NodeField<std::uint32_t> number(c_.lower(), c_.upper(), kNone, kNone);
        number.cover(air);
        for (std::uint32_t i = 0; i < air.size(); ++i) number.set(air[i], i);
        std::vector<std::optional<Coord>> found(air.size());
        const auto oneStepNearer = [&](Coord n) {
            std::optional<Coord> first;
            forNeighbours(n, [&](Coord m) {
                if (first) return;
                if (isMaterial(m))
                    first = m;
                else if (number(m) != kNone)
                    first = found[number(m)];
            });
            return first;
        };
        for (int step = 0; step < kWay; ++step) {
            std::vector<std::optional<Coord>> next = found;
            parallelChunks(air.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    if (!found[i]) next[i] = oneStepNearer(air[i]);
            });
            if (next == found) break;
            found.swap(next);
        }
        std::vector<std::optional<Coord>> material(nodes.size());
        parallelChunks(nodes.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (isClosed(nodes[i])) material[i] = found[number(nodes[i])];
        });
        return material;
    }
    const Field &rest_, &now_;
    double dx_;
    const FragmentAt& fragment_;
    std::span<const Coord> between_;  // parts that are apart at rest; rising
    Field raised_;                    // phi of the nodes inside that a crack has raised; kNotRaised elsewhere
    Field c_;
    std::vector<Coord> near_;  // nodes that were given a value
};

}  // namespace

CrackField crackField(const Field& rest, const Field& now, double dx, const FragmentAt& fragment,
                      std::span<const Coord> between)
{
    return Extension(rest, now, dx, fragment, between).run();
}

}  // namespace vdbfrac::skin
