// Which parts of a system move on their own, and which are held. Not installed.
#pragma once

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/solver/backward_euler.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// Connected parts of the material; those that couplings join are one, those that an external one holds are held.
class LooseParts {
public:
    void find(const Boundary& boundary, std::span<const Coupling> couplings);

    std::size_t numbers() const { return held_.size(); }  ///< above those of all parts
    /// Number of the part that a node is in.
    std::size_t operator[](std::size_t node) const { return label_.empty() ? 0 : nameOf_[label_[node]]; }
    bool isHeld(std::size_t part) const { return held_[part]; }

private:
    std::span<const std::uint32_t> label_;  // of each node, before parts are joined; empty: all is one part
    std::vector<std::uint32_t> nameOf_;     // of each label
    std::vector<std::uint8_t> held_;
};

}  // namespace vdbfrac::solver
