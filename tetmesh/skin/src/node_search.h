// A search among the nodes round one. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>

#include <bitset>
#include <cstddef>
#include <optional>
#include <vector>

namespace vdbfrac::skin {

/// Nodes round one, each once, in the order in which they are reached.
class NodeSearch {
public:
    explicit NodeSearch(Coord start) : lower_(start - Coord{kReach, kReach, kReach}) { add(start); }
    void add(Coord n)
    {
        const Coord d = n - lower_;
        if (d.x < 0 || d.y < 0 || d.z < 0 || d.x >= kSize || d.y >= kSize || d.z >= kSize) return;
        const std::size_t k = std::size_t((d.z * kSize + d.y) * kSize + d.x);
        if (seen_[k]) return;
        seen_[k] = true;
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

}  // namespace vdbfrac::skin
