// What a preconditioner knows of the couplings that it was made for. Not installed.
#pragma once

#include <vdbfrac/solver/coupling.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::solver {

class CoupledDiagonal {
public:
    CoupledDiagonal() = default;
    explicit CoupledDiagonal(const NodeBlocks* blocks);

    /// Have couplings come, gone or changed so much that a preconditioner would rather know?
    bool changesMuch(const CoupledDiagonal& now) const;
    /// Is there a node that a smoother made before would move much too far? `stiffness` [N/m]: elastic part of each
    /// node.
    bool growsMuch(const CoupledDiagonal& now, std::span<const double> stiffness) const;

private:
    /// Calls visit(node, trace before, trace now) for the nodes that have one.
    template <class Visit>
    void eachCoupled(const CoupledDiagonal& now, const Visit& visit) const;

    std::vector<std::pair<std::uint32_t, double>> traces_;  // of the diagonal blocks [N/m], by node
};

}  // namespace vdbfrac::solver
