// Inverses of the 3x3 diagonal blocks of a linear system, in single precision. Not installed.
#pragma once

#include "kernel.h"

#include <vdbfrac/solver/linear_solver.h>

#include <span>
#include <vector>

namespace vdbfrac::solver {

class BlockDiagonal {
public:
    void resize(std::size_t nodes) { lanes_.resize((nodes + kLanes - 1) / kLanes); }
    const LaneBlocks* lanes() const { return lanes_.data(); }
    /// k: xx, yy, zz, yz, zx, xy.
    float& at(std::size_t node, std::size_t k) { return lanes_[node / kLanes].v[k][node % kLanes]; }
    template <class V>
    V times(std::size_t node, const V& r) const
    {
        using Real = typename V::Scalar;
        const auto v = [&](std::size_t k) { return Real(lanes_[node / kLanes].v[k][node % kLanes]); };
        return V(v(0) * r[0] + v(5) * r[1] + v(4) * r[2], v(5) * r[0] + v(1) * r[1] + v(3) * r[2],
                 v(4) * r[0] + v(3) * r[1] + v(2) * r[2]);
    }
    std::size_t bytes() const { return lanes_.capacity() * sizeof(LaneBlocks); }

private:
    std::vector<LaneBlocks> lanes_;
};

/// Writes the inverse block of each node to `inverse`: 0 at fixed nodes and where there is no material; a multiple of
/// the identity where the block is not positive definite. `extra` [N/m], if any, is added to the diagonal.
void invertDiagonal(const LinearSystem& system, std::span<const float> extra, BlockDiagonal& inverse);

}  // namespace vdbfrac::solver
