// Sets that are joined until they are asked for (union-find with path halving; Tarjan & van Leeuwen 1984).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace vdbfrac {

/// Sets of the numbers from 0 on, each named by its least one.
class DisjointSets {
public:
    /// Each number is a set of its own.
    explicit DisjointSets(std::size_t count = 0) { grow(count); }
    /// Each number is in the set of `parent[number]`, which is no greater.
    explicit DisjointSets(std::vector<std::uint32_t> parent) : parent_(std::move(parent)) {}

    /// Adds numbers up to `count`, each a set of its own.
    void grow(std::size_t count)
    {
        const std::size_t old = parent_.size();
        parent_.resize(count);
        std::iota(parent_.begin() + std::ptrdiff_t(old), parent_.end(), std::uint32_t(old));
    }
    std::size_t size() const { return parent_.size(); }

    std::uint32_t find(std::uint32_t v)
    {
        while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
        return v;
    }
    /// Joins the set of v to that named r; returns the name of both.
    std::uint32_t joinTo(std::uint32_t r, std::uint32_t v)
    {
        if (parent_[v] == r) return r;  // nearly always, where neighbours come one after another
        const std::uint32_t other = find(v), least = std::min(r, other);
        parent_[std::max(r, other)] = least;
        return least;
    }
    void join(std::uint32_t a, std::uint32_t b) { joinTo(find(a), b); }

    /// Name of the set of each number. A name comes before all others of its set.
    std::vector<std::uint32_t> names() &&
    {
        for (std::uint32_t& r : parent_) r = parent_[r];
        return std::move(parent_);
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace vdbfrac
