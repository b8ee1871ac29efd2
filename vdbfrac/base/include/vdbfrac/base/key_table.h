// Rows of a list found again by their keys.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac {

/// A table with open addresses, half full at most.
class KeyTable {
public:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    /// `keys`: of all rows that may be added; they have to live as long.
    explicit KeyTable(std::span<const std::uint64_t> keys)
        : keys_(keys), bits_(std::bit_width(2 * keys.size() + 1)), row_(std::size_t{1} << bits_, kNone)
    {
    }
    /// Adds a row unless one with its key is there; returns the one that is.
    std::uint32_t add(std::uint32_t row)
    {
        std::uint32_t& there = row_[placeOf(keys_[row])];
        return there == kNone ? there = row : there;
    }
    /// kNone where no row has this key.
    std::uint32_t find(std::uint64_t key) const { return row_[placeOf(key)]; }

private:
    std::size_t placeOf(std::uint64_t key) const
    {
        const std::size_t last = row_.size() - 1;
        std::size_t at = std::size_t(key * 0x9E3779B97F4A7C15u >> (64 - bits_));
        while (row_[at] != kNone && keys_[row_[at]] != key) at = (at + 1) & last;
        return at;
    }

    std::span<const std::uint64_t> keys_;
    int bits_;
    std::vector<std::uint32_t> row_;
};

}  // namespace vdbfrac
