// Which node each node was a frame before: what surfaces of one topology over a whole run need.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::core {

/// Nodes only split, so each has one ancestor in every frame before.
class Ancestry {
public:
    explicit Ancestry(std::size_t bodies) : bodies_(bodies) {}

    /// A body was cut again on the way to a frame (counted from 1 at the first after rest); previous: CutUpdate's.
    void recut(std::size_t body, std::span<const std::uint32_t> previous, int frame);
    /// Of each node of a body in a frame: its number in the frame before. Empty where they are the same.
    std::span<const std::uint32_t> before(std::size_t body, int frame) const;

    void save(Archive& archive) const;
    void restoreFrom(const Archive& archive, std::span<const Body> bodies);

private:
    struct Stretch {
        std::int32_t frame = 0;
        std::vector<std::uint32_t> node;
    };
    std::vector<Stretch> bodies_;  // since the frame before `frame`
};

}  // namespace vdbfrac::core
