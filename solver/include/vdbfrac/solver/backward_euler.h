// One time step of backward Euler, as the minimum of
//   Phi(x) = |x - x~|_M^2 / (2 dt^2) + Psi(x) + sum of potentials - f.x,   x~ = x_n + dt v_n,
// by Newton's method with line search; linear systems as in linear_solver.h, solved only as far as the step needs.
// Martin et al. 2011, section 4 (the variational form); Smith, de Goes, Kim 2019 (definite tangent).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/solver/potential.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// What stands in for the second derivative in a Newton iteration.
enum class NewtonTangent {
    exact,      ///< itself; projected only where it shows negative curvature or does not descend
    projected,  ///< always made semidefinite
    warped,     ///< linear elasticity in the rotated frame of each tet: no stress terms
};

struct NewtonSettings {
    /// Of |gradient|, relative to the largest of inertia, elastic and outer force; and 1/20 of the cells that a node
    /// may be off where its own forces balance.
    double tolerance = 1e-3;
    int iterations = 20;
    /// Of the preconditioned residual norm; looser where less is enough to bring the gradient below its tolerance
    /// (inexact Newton; Dembo, Eisenstat, Steihaug 1982).
    double linearTolerance = 1e-2;
    int linearIterations = 2000;
    LinearMethod linearMethod = LinearMethod::automatic;
    LinearPrecision linearPrecision = LinearPrecision::mixed;
    NewtonTangent tangent = NewtonTangent::exact;
};

/// Positions and velocities of all nodes.
struct State {
    std::vector<Vec3> x;  ///< m
    std::vector<Vec3> v;  ///< m/s
};

/// Nodes whose position is prescribed at the end of the step, and forces on the others.
struct Boundary {
    std::vector<std::uint8_t> fixed;  ///< 1 for a prescribed node; one entry a node
    std::vector<Vec3> target;         ///< m, read where fixed
    std::vector<Vec3> force;          ///< N on each node
    std::vector<std::uint32_t> part;  ///< of each node: number of its connected part; empty: all is one part
};

enum class StepStatus { converged, capped };

struct StepReport {
    StepStatus status = StepStatus::converged;
    int newtonIterations = 0;
    int linearIterations = 0;
    int multigridSystems = 0;  ///< linear systems that multigrid solved
    int projections = 0;       ///< linear systems for which the tangent had to be projected
    int lineSearchSteps = 0;   ///< halvings
    /// 1 where the minimum lies at a crease of Phi: its residual is that of the mean of the gradients beside it.
    int creases = 0;
    std::size_t couplings = 0;    ///< shares of potentials in the tangent at the end
    double residual = 0;          ///< |gradient| at the end, relative to the scale of the tolerance
    double minResidual = 0;       ///< smallest of the iterates: below `residual` where Newton went astray
    std::uint32_t worstNode = 0;  ///< capped: the free node with the largest gradient
    double elasticEnergy = 0;     ///< J at the end
    double inertialLoss = 0;      ///< J: |v1 - v0|_M^2 / 2
    double elasticWork = 0;       ///< J that the elastic forces of the end take along the way; static: 0
    std::size_t frozenNodes = 0;  ///< static: nodes of parts that nothing holds, which stay where they are
    std::vector<Vec3> reaction;   ///< N that holds each fixed node: gradient of Phi there, 0 elsewhere
};

/// What a step acts on besides the state.
struct System {
    std::span<Potential* const> potentials;
    const Boundary& boundary;
    double time = 0;   ///< s: where forces are taken
    double begin = 0;  ///< s: start of the interval that is solved for
};

/// Keeps its memory from step to step: after the first step of an operator nothing is allocated.
class BackwardEuler {
public:
    BackwardEuler(const ElasticOperator& elastic, const NewtonSettings& settings);
    ~BackwardEuler();
    BackwardEuler(BackwardEuler&&) noexcept;
    BackwardEuler& operator=(BackwardEuler&&) noexcept;

    /// Goes on with another operator, in the same memory where it suffices.
    void rebind(const ElasticOperator& elastic);

    /// Advances `state` by dt [s]; dt = infinity asks for the static equilibrium. On StepStatus::capped the state is
    /// the last iterate, and the caller decides whether to keep it. The report holds until the next step. A part
    /// without fixed nodes keeps its momentum balance to rounding, however loose the tolerances: what the linear solver
    /// left of its mean force is taken out by a shift of the part.
    [[nodiscard]] const StepReport& step(State& state, double dt, const System& system);

    /// Relative residual |gradient| of the step from `state` that ends at x, on the scale of NewtonSettings::tolerance:
    /// one measure for all settings.
    double residual(const State& state, double dt, const System& system, std::span<const Vec3> x);

    std::size_t bytes() const;  ///< the operator apart

private:
    class Newton;
    std::unique_ptr<Newton> newton_;
};

/// A single step.
[[nodiscard]] StepReport stepBackwardEuler(const ElasticOperator& elastic, State& state, double dt,
                                           const System& system, const NewtonSettings& settings);

}  // namespace vdbfrac::solver
