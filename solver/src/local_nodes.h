// Numbers of the nodes of a patch. Not installed.
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::solver {

/// A run of consecutive elements of one set that share a patch.
struct Range {
    const ElementSet* set;
    std::size_t begin, end;  // in the set
};

/// The box of lattice nodes that a range touches, with a place for each.
class Box {
public:
    explicit Box(const Range& range) : nodes_(range.set->nodes)
    {
        const auto& elements = range.set->elements;
        low_ = nodes_[elements[range.begin].node[0]];
        Coord high = low_;
        for (std::size_t e = range.begin; e < range.end; ++e)
            for (std::uint32_t node : elements[e].node) {
                const Coord c = nodes_[node];
                low_ = {std::min(low_.x, c.x), std::min(low_.y, c.y), std::min(low_.z, c.z)};
                high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
            }
        size_ = high - low_ + Coord{1, 1, 1};
    }
    std::size_t places() const { return std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z); }
    std::size_t placeOf(std::uint32_t node) const
    {
        const Coord c = nodes_[node] - low_;
        return (std::size_t(c.z) * std::size_t(size_.y) + std::size_t(c.y)) * std::size_t(size_.x) + std::size_t(c.x);
    }

private:
    std::span<const Coord> nodes_;
    Coord low_, size_;
};

/// Local numbers of the nodes of a range of tets that are on no lattice: by rising number.
class SortedNodes {
public:
    explicit SortedNodes(const Range& range)
    {
        for (std::size_t e = range.begin; e < range.end; ++e) {
            const auto& node = range.set->elements[e].node;
            nodes.insert(nodes.end(), node.begin(), node.end());
        }
        sortUnique(nodes);
    }
    std::uint16_t operator[](std::uint32_t node) const
    {
        return std::uint16_t(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
    }

    std::vector<std::uint32_t> nodes;
};

/// Local numbers of the nodes of a range: along rows of the lattice, so that cells in a row read and write consecutive
/// values; copies of a node follow each other by rising system number.
class LocalNodes {
public:
    explicit LocalNodes(const Range& range) : box_(range), first_(box_.places(), kNone)
    {
        for (std::size_t e = range.begin; e < range.end; ++e)
            for (std::uint32_t node : range.set->elements[e].node) note(node);
        number();
    }
    std::uint16_t operator[](std::uint32_t node) const
    {
        const std::size_t place = box_.placeOf(node);
        std::uint32_t local = start_[place];
        while (nodes[local] != node) ++local;
        return std::uint16_t(local);
    }

    std::vector<std::uint32_t> nodes;

private:
    static constexpr std::uint32_t kNone = 0xffffffff;

    void note(std::uint32_t node)
    {
        const std::size_t place = box_.placeOf(node);
        if (first_[place] == kNone)
            first_[place] = node;
        else if (first_[place] != node)
            copies_.push_back({std::uint32_t(place), node});
    }
    void number()
    {
        sortUnique(copies_);
        start_.resize(first_.size());
        auto copy = copies_.begin();
        for (std::size_t place = 0; place < first_.size(); ++place) {
            start_[place] = std::uint32_t(nodes.size());
            if (first_[place] == kNone) continue;
            nodes.push_back(first_[place]);
            for (; copy != copies_.end() && copy->first == place; ++copy) nodes.push_back(copy->second);
            std::sort(nodes.begin() + start_[place], nodes.end());
        }
    }

    Box box_;
    std::vector<std::uint32_t> first_, start_;                     // of each place
    std::vector<std::pair<std::uint32_t, std::uint32_t>> copies_;  // place, node
};

}  // namespace vdbfrac::solver
