// Values on integer coordinates, stored in 8^3 blocks where they differ from "far outside" or "deep inside".
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/vec.h>

#include <array>
#include <cassert>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// Bits of a coordinate within the box of a body, where places are packed into one number.
inline constexpr int kPlaceBits = 18;

/// A sparse field over the box [lower, upper] (both included). A block that was never written reads `outside`
/// or, when so marked, `inside`. Coordinates beyond the box read `outside`. Blocks are kept in a fixed order,
/// so walking them is the same on every run.
template <class T>
class NodeField {
public:
    static constexpr int kEdge = 8;  ///< nodes along a block's edge: the leaf size of an OpenVDB tree
    static constexpr int kBlock = kEdge * kEdge * kEdge;

    NodeField() = default;
    NodeField(Coord lower, Coord upper, T outside, T inside)
        : lower_(lower),
          upper_(upper),
          first_{lower.x >> 3, lower.y >> 3, lower.z >> 3},
          count_{(upper.x >> 3) - first_.x + 1, (upper.y >> 3) - first_.y + 1, (upper.z >> 3) - first_.z + 1},
          outside_(outside),
          inside_(inside),
          directory_(std::size_t(count_.x) * std::size_t(count_.y) * std::size_t(count_.z), kOutside)
    {
    }

    const T& operator()(Coord c) const
    {
        const std::size_t b = blockIndex(c);
        if (b == kNowhere) return outside_;
        const std::int32_t d = directory_[b];
        if (d >= 0) return blocks_[std::size_t(d)][local(c)];
        return d == kOutside ? outside_ : inside_;
    }

    /// Makes the blocks of nodes within the box, which can then be set side by side.
    void cover(std::span<const Coord> nodes)
    {
        std::vector<std::size_t> fresh;
        for (const Coord& c : nodes)
            if (const std::size_t b = blockIndex(c); directory_[b] < 0 && (fresh.empty() || fresh.back() != b))
                fresh.push_back(b);
        sortUnique(fresh);
        blocks_.reserve(blocks_.size() + fresh.size());
        for (const std::size_t b : fresh) make(b);
    }

    void set(Coord c, T value) { block(c)[local(c)] = value; }
    T& at(Coord c) { return block(c)[local(c)]; }  ///< valid until another block is written first

    /// Null where no block is, or c is beyond the box.
    T* find(Coord c)
    {
        const std::size_t b = blockIndex(c);
        return b == kNowhere || directory_[b] < 0 ? nullptr : &blocks_[std::size_t(directory_[b])][local(c)];
    }

    /// Marks the whole block that holds c as deep inside.
    void fillInside(Coord c)
    {
        const std::size_t b = blockIndex(c);
        assert(b != kNowhere && directory_[b] < 0);
        directory_[b] = kInside;
    }

    /// Calls visit(lowest coordinate of the block) for every block that may hold anything but `outside`,
    /// in a fixed order.
    template <class Visit>
    void forEachBlock(const Visit& visit) const
    {
        std::size_t b = 0;
        for (int z = 0; z < count_.z; ++z)
            for (int y = 0; y < count_.y; ++y)
                for (int x = 0; x < count_.x; ++x, ++b)
                    if (directory_[b] != kOutside) visit(kEdge * Coord{first_.x + x, first_.y + y, first_.z + z});
    }

    /// Calls visit(c) for the nodes of a block, x fastest; `low`: as forEachBlock gives it.
    template <class Visit>
    static void forEachNode(Coord low, const Visit& visit)
    {
        for (int z = 0; z < kEdge; ++z)
            for (int y = 0; y < kEdge; ++y)
                for (int x = 0; x < kEdge; ++x) visit(low + Coord{x, y, z});
    }

    bool empty() const { return directory_.empty(); }
    bool contains(Coord c) const { return blockIndex(c) != kNowhere; }
    Coord lower() const { return lower_; }
    Coord upper() const { return upper_; }
    std::size_t bytes() const { return blocks_.size() * sizeof(Block) + directory_.size() * sizeof(std::int32_t); }

private:
    using Block = std::array<T, kBlock>;
    static constexpr std::int32_t kOutside = -1, kInside = -2;
    static constexpr std::size_t kNowhere = ~std::size_t{0};

    std::size_t blockIndex(Coord c) const
    {
        const int x = (c.x >> 3) - first_.x, y = (c.y >> 3) - first_.y, z = (c.z >> 3) - first_.z;
        if (x < 0 || y < 0 || z < 0 || x >= count_.x || y >= count_.y || z >= count_.z) return kNowhere;
        return (std::size_t(z) * std::size_t(count_.y) + std::size_t(y)) * std::size_t(count_.x) + std::size_t(x);
    }
    static std::size_t local(Coord c) { return std::size_t((c.x & 7) | (c.y & 7) << 3 | (c.z & 7) << 6); }

    Block& block(Coord c)
    {
        const std::size_t b = blockIndex(c);
        assert(b != kNowhere);
        if (directory_[b] < 0) make(b);
        return blocks_[std::size_t(directory_[b])];
    }
    void make(std::size_t b)
    {
        blocks_.emplace_back();
        blocks_.back().fill(directory_[b] == kOutside ? outside_ : inside_);
        directory_[b] = std::int32_t(blocks_.size()) - 1;
    }

    Coord lower_{}, upper_{};
    Coord first_{}, count_{};  // in blocks
    T outside_{}, inside_{};
    std::vector<std::int32_t> directory_;
    std::vector<Block> blocks_;
};

}  // namespace vdbfrac::tetmesh
