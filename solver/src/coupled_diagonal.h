// What a preconditioner knows of the couplings that it was made for. Not installed.
#pragma once

#include <vdbfrac/solver/coupling.h>
#include <vdbfrac/solver/linear_solver.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::solver {

class CoupledDiagonal {
public:
    CoupledDiagonal() = default;
    explicit CoupledDiagonal(const NodeBlocks* blocks);

    /// Have couplings come, gone or changed so much that a preconditioner would rather know?
    bool changesMuch(const NodeBlocks* now) const;
    /// Is there a node that a smoother made before would move much too far?
    bool growsMuch(const LinearSystem& now) const;

private:
    std::vector<std::pair<std::uint32_t, double>> traces_;  // of the diagonal blocks [N/m], by node
};

}  // namespace vdbfrac::solver
