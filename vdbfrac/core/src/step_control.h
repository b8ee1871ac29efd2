// How long the next step may be. Not installed.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/solver/integrator.h>

#include <limits>
#include <span>

namespace vdbfrac::core {

/// What there is to look at when a step begins.
struct StepOutlook {
    std::span<const Body> bodies;
    const solver::State& state;
    double time;  ///< s
    const Stages& stages;
    const solver::Integrator& integrator;
};

class StepControl {
public:
    /// `spacing`: of the lattice [m].
    StepControl(const scene::Time& time, double spacing) : settings_(time), h_(spacing) {}

    struct Choice {
        double dt = 0;        ///< s
        double shortest = 0;  ///< s: what does not converge then is kept as it is
        int halvings = 0;     ///< made at once, since nodes fly apart
    };
    /// The next of the steps that lead over `left` s, as long as scene, effects and integrator allow.
    Choice next(double left, const StepOutlook& outlook) const;

    /// A step of `tried` s came to its end as one of `dt` s.
    void learn(double tried, double dt) { trusted_ = dt < tried ? dt : 2 * trusted_; }
    /// A longer step [s] is not tried after a cut-back; doubles with each step.
    double trusted() const { return trusted_; }
    void restoreTrusted(double trusted) { trusted_ = trusted; }

private:
    double limit(double spread, const StepOutlook& outlook) const;

    scene::Time settings_;
    double h_;
    double trusted_ = std::numeric_limits<double>::infinity();
};

}  // namespace vdbfrac::core
