// Linear systems of a Newton step, A u = b with A = m M + K + H on the free nodes: M lumped mass, K the tangent, H
// couplings.
//
//   jacobi     conjugate gradients (Hestenes & Stiefel 1952) with the 3x3 diagonal blocks: the least work where the
//              time step is short; iterations grow with the nodes a side. Tolerances of 1e-4 and looser are reached
//              with vectors in single precision: what such a step is worth is seen in Newton's residual, in double.
//   multigrid  conjugate gradients with one W-cycle over lattices of twice the spacing, in single precision (the
//              residual of the outer iteration is in double): iterations do not grow. Cracks do not couple on any
//              level.
//   direct     the assembled matrix and a sparse Cholesky factorisation (CHOLMOD; Chen, Davis, Hager, Rajamanickam
//              2008): small or very stiff systems.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <cstdint>
#include <memory>
#include <span>

namespace vdbfrac::solver {

enum class LinearMethod { automatic, jacobi, multigrid, direct };
/// mixed: vectors of block-Jacobi in single precision where the tolerance allows it; doubles: always in double.
enum class LinearPrecision { mixed, doubles };

struct LinearSystem {
    const ElasticOperator& elastic;
    const Tangent& tangent;
    double massFactor = 0;                ///< m [1/s^2]
    std::span<const std::uint8_t> fixed;  ///< 1 for a node that does not move; one entry a node
    const NodeBlocks* blocks = nullptr;   ///< what couples nodes beyond the elements; null: nothing does
};

struct LinearLimits {
    double tolerance = 1e-2;  ///< of the preconditioned residual norm, relative to that of b
    int iterations = 2000;
};

enum class LinearStatus { converged, capped, negativeCurvature };

struct LinearReport {
    LinearStatus status = LinearStatus::converged;
    LinearMethod method = LinearMethod::jacobi;  ///< that was used
    int iterations = 0;
};

/// Solver for the systems of one operator; keeps its memory from one system to the next.
class LinearSolver {
public:
    LinearSolver(const ElasticOperator& elastic, LinearMethod method,
                 LinearPrecision precision = LinearPrecision::mixed);
    ~LinearSolver();
    LinearSolver(LinearSolver&&) noexcept;
    LinearSolver& operator=(LinearSolver&&) noexcept;

    /// Goes on with another operator. Work vectors keep their memory; multigrid and factors are made anew.
    void rebind(const ElasticOperator& elastic);

    /// Solves A u = b from u = 0; u is 0 at fixed nodes. Iterations stop at the first direction p with p.A p <= 0 and
    /// leave u as it was before it; the direct method reports a matrix that is not positive definite the same way.
    /// `samePreconditioner`: that of the last system serves, which had the same fixed nodes and nearly the same
    /// tangent; couplings that have changed much since are put into it anew.
    [[nodiscard]] LinearReport solve(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u,
                                     LinearLimits limits, bool samePreconditioner = false);

    std::size_t bytes() const;

private:
    struct Data;

    void prepare(const LinearSystem& system, LinearMethod method);
    void prepareAgain(const LinearSystem& system);
    LinearReport solveDirectly(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u);

    std::unique_ptr<Data> data_;
};

/// Fixed-order dot product.
double dot(std::span<const Vec3> a, std::span<const Vec3> b);

}  // namespace vdbfrac::solver
