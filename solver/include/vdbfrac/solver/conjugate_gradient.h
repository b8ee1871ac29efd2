// Preconditioned conjugate gradients on vectors of nodes (Hestenes & Stiefel 1952), with fixed nodes held at 0.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::solver {

struct LinearSystem {
    /// out = A u for u that is 0 at fixed nodes; what it writes there is ignored.
    std::function<void(std::span<const Vec3> u, std::span<Vec3> out)> product;
    std::span<const Mat3> inverseDiagonal;   ///< block-Jacobi preconditioner
    std::span<const std::uint8_t> fixed;
};

struct LinearLimits {
    double tolerance = 1e-2;
    int iterations = 2000;
};

enum class LinearStatus { converged, capped, negativeCurvature };

struct LinearReport {
    LinearStatus status = LinearStatus::converged;
    int iterations = 0;
};

/// Solves A u = b from u = 0 until the preconditioned residual norm has fallen by `limits.tolerance`. Stops at the first
/// direction p with p.A p <= 0 and leaves u as it was before it.
[[nodiscard]] LinearReport solveConjugateGradient(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u,
                                                  LinearLimits limits);

/// Fixed-order dot product.
double dot(std::span<const Vec3> a, std::span<const Vec3> b);

}  // namespace vdbfrac::solver
