// One time step of backward Euler, as the minimum of
//   Phi(x) = |x - x~|_M^2 / (2 dt^2) + Psi(x) + sum of potentials - f.x,   x~ = x_n + dt v_n,
// by Newton's method with line search; linear systems by conjugate gradients with 3x3 block-Jacobi.
// Martin et al. 2011, section 4 (the variational form); Smith, de Goes, Kim 2019 (definite tangent).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/solver/potential.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

struct NewtonSettings {
    double tolerance = 1e-3;        ///< of |gradient|, relative to the largest of inertia, elastic and outer force
    int iterations = 20;
    double linearTolerance = 1e-2;  ///< of the preconditioned residual norm
    int linearIterations = 2000;
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
    int projections = 0;        ///< linear systems for which the tangent had to be projected
    int lineSearchSteps = 0;    ///< halvings
    double residual = 0;        ///< |gradient| at the end, relative to the scale of the tolerance
    double elasticEnergy = 0;   ///< J at the end
    std::vector<Vec3> reaction; ///< N that holds each fixed node: gradient of Phi there, 0 elsewhere
};

/// What a step acts on besides the state.
struct System {
    const ElasticOperator& elastic;
    std::span<Potential* const> potentials;
    const Boundary& boundary;
};

/// A part without fixed nodes keeps its momentum balance to rounding, however loose the tolerances: what the linear
/// solver left of its mean force is taken out by a shift of the part.
/// Advances `state` by dt [s]; dt = infinity asks for the static equilibrium. On StepStatus::capped the state is the
/// last iterate, and the caller decides whether to keep it.
[[nodiscard]] StepReport stepBackwardEuler(State& state, double dt, const System& system, const NewtonSettings& settings);

}  // namespace vdbfrac::solver
