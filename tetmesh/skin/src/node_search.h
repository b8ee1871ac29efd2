// A search among the nodes round one. Not installed.
#pragma once

#include "crack_lattice.h"

#include <vdbfrac/base/vec.h>

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <vector>

namespace vdbfrac::skin {

/// Nodes round one, each once, in the order in which they are reached.
class NodeSearch {
public:
    explicit NodeSearch(Coord start) : lower_(start - Coord{kReach, kReach, kReach}) { add(start); }
    void add(Coord n)
    {
        add(n, [](Coord) { return true; });
    }
    /// Where it is one that `belongs`, which is asked once for each.
    template <class Belongs>
    void add(Coord n, const Belongs& belongs)
    {
        const Coord d = n - lower_;
        if (d.x < 0 || d.y < 0 || d.z < 0 || d.x >= kSize || d.y >= kSize || d.z >= kSize) return;
        const std::size_t k = std::size_t((d.z * kSize + d.y) * kSize + d.x);
        if (seen_[k]) return;
        seen_[k] = true;
        if (!belongs(n)) return;
        reached_.push_back(n);
        steps_.push_back(at_ > 0 ? steps_[at_ - 1] + 1 : 0);
    }
    std::optional<Coord> next() { return at_ < reached_.size() ? std::optional(reached_[at_++]) : std::nullopt; }
    /// From the start to the node that next() gave: the fewest, where neighbours of each node are added after it.
    int steps() const { return steps_[at_ - 1]; }

private:
    static constexpr int kReach = 5, kSize = 2 * kReach + 1;
    Coord lower_;
    std::bitset<std::size_t(kSize) * kSize * kSize> seen_;
    std::vector<Coord> reached_;
    std::vector<int> steps_;
    std::size_t at_ = 0;
};

/// Does a way through material lead from one node to another that turns back on no axis?
template <class IsMaterial>
bool isStraightWay(Coord a, Coord b, const IsMaterial& isMaterial)
{
    const auto goesOn = [&](Coord m) { return m == b || (isMaterial(m) && isStraightWay(m, b, isMaterial)); };
    const auto step = [](int from, int to) { return (from < to) - (to < from); };
    return (a.x != b.x && goesOn({a.x + step(a.x, b.x), a.y, a.z})) ||
           (a.y != b.y && goesOn({a.x, a.y + step(a.y, b.y), a.z})) ||
           (a.z != b.z && goesOn({a.x, a.y, a.z + step(a.z, b.z)}));
}

/// Does an edge join two nodes, which have material, or a short way of that kind?
template <class IsMaterial>
bool areStraightJoined(Coord a, Coord b, const IsMaterial& isMaterial)
{
    constexpr int kFew = 5;  // edges of ways that are tried one by one
    const Coord way = b - a;
    bool isBeside = a == b;
    forNeighbours(a, [&](Coord m) { isBeside = isBeside || m == b; });
    return isBeside || (std::abs(way.x) + std::abs(way.y) + std::abs(way.z) <= kFew && isStraightWay(a, b, isMaterial));
}

/// Does material near two nodes, which have some, join them? A way round the front of a crack counts beside it only.
template <class IsMaterial>
bool areJoined(Coord a, Coord b, const IsMaterial& isMaterial)
{
    constexpr int kRound = 1;
    if (areStraightJoined(a, b, isMaterial)) return true;
    const auto isBetween = [](int m, int p, int q) {
        return std::min(p, q) - kRound <= m && m <= std::max(p, q) + kRound;
    };
    NodeSearch search(a);
    while (const std::optional<Coord> at = search.next()) {
        if (*at == b) return true;
        forNeighbours(*at, [&](Coord m) {
            if (isBetween(m.x, a.x, b.x) && isBetween(m.y, a.y, b.y) && isBetween(m.z, a.z, b.z))
                search.add(m, isMaterial);
        });
    }
    return false;
}

}  // namespace vdbfrac::skin
