// Something that has an energy over a time step: what joins the solve besides inertia and elasticity.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <span>

namespace vdbfrac::solver {

/// What is known when a step begins.
struct StepStart {
    std::span<const Vec3> x;  ///< [m] at the start
    std::span<const Vec3> v;  ///< [m/s]
    double dt = 0;            ///< s
    const ElasticOperator& elastic;
};

/// The Hessian of a potential as the tangent takes it in: `mass` times the lumped mass [1/s^2] and `stiffness` times
/// linear elasticity in the rotated frame of each tet. A product with the tangent then costs the same with and without
/// it.
struct HessianShares {
    double mass = 0, stiffness = 0;
};

/// What resists a velocity v with the force -(mass M + stiffness K) v: mass [1/s], stiffness [s].
struct RayleighDamping {
    double mass = 0, stiffness = 0;
};

/// U(x) with its gradient and a positive semidefinite approximation of its Hessian, each checked against the other
/// by finite differences in the tests. Forces that do not come from an energy of x alone (damping) use one that
/// holds for this step only.
class Potential {
public:
    virtual ~Potential() = default;
    virtual void begin(const StepStart&) {}
    /// Value [J]; adds the gradient [N].
    virtual double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const = 0;
    /// Constant over the step.
    virtual HessianShares hessian() const { return {}; }
    /// The same in all steps.
    virtual RayleighDamping damping() const { return {}; }
    /// Is the value an energy of x alone as long as the mesh is the same? Then its fall is the work of its forces; of
    /// others nothing is known.
    virtual bool isConservative() const { return false; }
    /// Memory it keeps from step to step.
    virtual std::size_t bytes() const { return 0; }
};

}  // namespace vdbfrac::solver
