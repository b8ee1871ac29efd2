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

namespace vdbfrac::solver {

enum class Scheme { backwardEuler, midpoint, sdirk2, symplecticEuler, forwardEuler, statics };

/// What acts on a step from outside.
struct StepLoads {
    std::span<Potential* const> potentials;
    /// Boundary at the start of the step plus `share` of it. The result holds until the next call.
    std::function<const Boundary&(double share)> boundary;
};

/// Keeps its memory from step to step.
class Integrator {
public:
    virtual ~Integrator() = default;

    /// Goes on with another operator, of the same bodies less what has gone since.
    virtual void rebind(const ElasticOperator& elastic) = 0;
    /// Advances `state` by dt [s] > 0, finite; it is what the last step left, or rebind() was called since. The report
    /// holds until the next step; its energy is that of the end, its reactions those of the last solve: in mid-step
    /// with midpoint, at the start of the step with the explicit schemes.
    [[nodiscard]] virtual const StepReport& step(State& state, double dt, const StepLoads& loads) = 0;
    /// Does it only ever look at forces it has, so that a step too long flies apart?
    virtual bool isExplicit() const { return false; }
    /// Step [s] beyond which the scheme is unstable with these potentials and the couplings that there are at x, with a
    /// reserve for deformed states; infinity if it never is.
    virtual double largestStep(std::span<Potential* const> potentials, std::span<const Vec3> x) const;
    virtual std::size_t bytes() const = 0;  ///< the operator apart
};

/// `elastic` must live until the next rebind. Explicit schemes have no use for the settings.
std::unique_ptr<Integrator> makeIntegrator(Scheme scheme, const ElasticOperator& elastic,
                                           const NewtonSettings& settings);

}  // namespace vdbfrac::solver
