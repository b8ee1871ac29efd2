// Ways to advance a state in time. All but the explicit ones solve steps of backward Euler: a scheme of higher order is
// one or two of them from other states, so that Newton's method, its tolerances and its remedies are those of
// backward_euler.h.
//
// Symbols: g gradient of all potentials less outer forces [N]; a = -M^-1 g; y = (x, v).
//   backward Euler    y1 = y0 + dt f(y1)                                           order 1, damps
//   midpoint          half a step of backward Euler to ym, then y1 = 2 ym - y0     order 2, keeps energy, does not damp
//   SDIRK2            gamma = 1 - 1/sqrt(2): a step of gamma dt to ya from y0, and one to y1 from
//                     y0 + (1 - gamma)/gamma (ya - y0)
//                     order 2, damps what the step does not resolve (Alexander 1977, section 3; L-stable)
//   symplectic Euler  v1 = v0 + dt a(x0), x1 = x0 + dt v1                          order 1, 2 in periods; dt bounded
//   forward Euler     x1 = x0 + dt v0, v1 = v0 + dt a(x0)                          order 1, gains energy at any dt
//   static            a = 0 at each step's end; v = 0
#pragma once

#include <vdbfrac/solver/backward_euler.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::solver {

enum class Scheme { backwardEuler, midpoint, sdirk2, symplecticEuler, forwardEuler, statics };

/// Where a step sets off.
struct StepOrigin {
    const State& state;
    double elasticEnergy;  ///< J
    bool balanced;         ///< does it solve the equations of the step before: nothing was cut, no load sets in
};

/// What acts on a step from outside.
struct StepLoads {
    std::span<Potential* const> potentials;
    /// Boundary at the start of the step plus `share` of it. The result holds until the next call.
    std::function<const Boundary&(double share)> boundary;
    const StepOrigin* origin = nullptr;  ///< null: nobody asks what becomes of the energy
    double time = 0;                     ///< s: when the step sets off
};

/// A leg of a step and what pushes held nodes along it.
struct HeldLeg {
    std::span<const Vec3> from, to, reaction;  ///< m, m, N
    double share;                              ///< of the step that is over when forces act as they do along the leg
};

/// What a step did to the energy, beside its change. With the work W of all forces that are known along all legs, T the
/// kinetic and Psi the elastic energy, W = change of T and Psi + loss, but for what the solver's tolerance leaves. Of a
/// step from (x0, v0) to (x1, v1), D = x1 - x0, g elastic gradient:
///   backward Euler    |v1 - v0|_M^2 / 2 + Psi0 - Psi1 + g(x1).D
///   midpoint          Psi0 - Psi1 + g(xm).D, and (v - v0).(3 v - v0) m / 2 of held nodes, v = D / dt
///   SDIRK2            |v1 - vb|_M^2 / 2 - |va - v0|_M^2 / 2 + Psi0 - Psi1 + g(xa).(xb - x0) + g(x1).(x1 - xb),
///                     b where its second solve sets off
///   symplectic Euler  |v1 - v0|_M^2 / 2 + Psi0 - Psi1 + g(x0).D
///   forward Euler     the same with - |v1 - v0|_M^2 / 2 of free nodes
///   static            what forces out of balance do while they come to rest, and T at the start: elastic ones by
///                     Simpson's rule, those of potentials as their flows say
struct StepEnergy {
    double loss = 0;                ///< J, but for that of potentials
    std::vector<EnergyFlow> flows;  ///< of each potential
    /// None: forces are known at the ends of the step only, and the report has those of its end. Until the state or the
    /// report change.
    std::vector<HeldLeg> legs;
    bool seesEnd = false;  ///< did the equations see the forces of the end all along the way?
};

/// Keeps its memory from step to step.
class Integrator {
public:
    virtual ~Integrator() = default;

    /// Goes on with another operator, of the same bodies less what has gone since.
    virtual void rebind(const ElasticOperator& elastic) = 0;
    /// Advances `state` by dt [s] > 0, finite: what the last step left, or what it began with (after a cut-back), or
    /// any after rebind(). The report holds until the next step; its energy is that of the end, its reactions those of
    /// the last solve: in mid-step with midpoint, at the start of the step with the explicit schemes.
    [[nodiscard]] virtual const StepReport& step(State& state, double dt, const StepLoads& loads) = 0;
    /// Does it only ever look at forces it has, so that a step too long flies apart?
    virtual bool isExplicit() const { return false; }
    /// Step [s] beyond which the scheme is unstable with these potentials and the couplings that there are at x, with a
    /// reserve for deformed states; infinity if it never is.
    virtual double largestStep(std::span<Potential* const> potentials, std::span<const Vec3> x) const;
    virtual std::size_t bytes() const = 0;  ///< the operator apart
    /// Of the last step that was given an origin.
    const StepEnergy& energy() const { return energy_; }

protected:
    void beginEnergy(const StepLoads& loads);
    void pass(const StepLoads& loads, const Leg& leg);

    StepEnergy energy_;
};

/// `elastic` must live until the next rebind. Explicit schemes have no use for the settings.
std::unique_ptr<Integrator> makeIntegrator(Scheme scheme, const ElasticOperator& elastic,
                                           const NewtonSettings& settings);

}  // namespace vdbfrac::solver
