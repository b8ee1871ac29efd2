// Something that has an energy over a time step: what joins the solve besides inertia and elasticity.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <span>
#include <vector>

namespace vdbfrac::solver {

/// What is known when a step begins.
struct StepStart {
    std::span<const Vec3> x;  ///< [m] at the start
    std::span<const Vec3> v;  ///< [m/s]
    double dt = 0;            ///< s
    const ElasticOperator& elastic;
    double time = 0;   ///< s: where forces are taken
    double begin = 0;  ///< s: start of the interval that is solved for
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

/// A way along which the equations of a step see the forces of one place. Most schemes have one a step.
struct Leg {
    std::span<const Vec3> from, to;  ///< m
    std::span<const Vec3> at;        ///< m: where the forces of potentials are taken
    /// How many times as long it is as the solve that they are of, which sets off where it does.
    double length = 1;
    bool isFirst = true;  ///< of its step
};

/// What something has done to the energy of the simulation.
struct EnergyFlow {
    double work = 0;        ///< J put in
    double dissipated = 0;  ///< J taken out for good
    double loss = 0;        ///< J that the scheme takes: work less what the forces of the equations do along the leg
};

/// A whole step, whatever stages it has.
struct WholeStep {
    std::span<const Vec3> from, to;  ///< m
    double begin = 0, end = 0;       ///< s
};

/// U(x) with its gradient and a positive semidefinite approximation of its Hessian, each checked against the other
/// by finite differences in the tests. Forces that do not come from an energy of x alone (damping, friction) use one
/// that holds for this step only.
///
/// begin() comes before each solve of a step: several times where a step is cut back or a scheme has several stages.
/// What lasts from step to step changes in accept(), and where begin() sees something for the first time at the start
/// of the step, which a try that is cut back does not change. What is measured from there, as slip is, starts at the
/// first begin() since accept(): later stages set off from places where nothing has been.
class Potential {
public:
    virtual ~Potential() = default;
    virtual void begin(const StepStart&) {}
    /// Value [J]; adds the gradient [N]. Both spans have an entry for each node of the system. Called by the thread
    /// that solves.
    virtual double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const = 0;
    /// Constant over the step.
    virtual HessianShares hessian() const { return {}; }
    /// Adds what couples nodes of the system at x to `couplings`: the rest of the Hessian, positive semidefinite. Where
    /// forces have no share in the tangent, nothing.
    virtual void linearize(std::span<const Vec3> /*x*/, std::vector<Coupling>& /*couplings*/) const {}
    /// The same for what is the curvature of numbers of elements, those of `elastic`. Asked before begin() too, for the
    /// step limit of explicit schemes, and with the elements of a mesh that was cut since.
    virtual void linearizeScalars(std::span<const Vec3> /*x*/, const ElasticOperator& /*elastic*/,
                                  std::vector<ScalarCoupling>& /*couplings*/) const
    {
    }
    /// An iteration has come to x. What adds nothing to U there may be left out from now on in this solve.
    virtual void prune(std::span<const Vec3> /*x*/) {}
    /// The step is solved at x. What holds for this step only may be brought up to date there: is that enough of a
    /// change to solve on?
    virtual bool refresh(std::span<const Vec3> /*x*/) { return false; }
    /// A step is solved. False where it has come to what a shorter one would not have: things have passed into each
    /// other. It is cut back then, as one that is not solved is, as long as that makes sense.
    virtual bool isAdmissible(const WholeStep& /*way*/) const { return true; }
    /// A step of `dt` [s] has come to its end at x, at this time [s], and is kept.
    virtual void accept(std::span<const Vec3> /*x*/, double /*time*/, double /*dt*/) {}
    /// What it did along a leg of the step that begin() was told of; before accept(). The columns of the effect.
    virtual EnergyFlow flow(const Leg& leg) const = 0;
    /// The same in all steps.
    virtual RayleighDamping damping() const { return {}; }
    /// Memory it keeps from step to step.
    virtual std::size_t bytes() const { return 0; }
};

/// The flow of a potential that is an energy of x alone: what it held before less what it holds after.
EnergyFlow storedFlow(const Potential& potential, const Leg& leg);

}  // namespace vdbfrac::solver
