#include <vdbfrac/solver/integrator.h>

#include "node_loops.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace vdbfrac::solver {

double Integrator::largestStep(std::span<Potential* const>, std::span<const Vec3>) const
{
    return std::numeric_limits<double>::infinity();
}

namespace {

/// What all implicit schemes share: the solver of their steps.
class Implicit : public Integrator {
public:
    Implicit(const ElasticOperator& elastic, const NewtonSettings& settings) : newton_(elastic, settings) {}
    void rebind(const ElasticOperator& elastic) override { newton_.rebind(elastic); }
    std::size_t bytes() const override { return newton_.bytes(); }

protected:
    BackwardEuler newton_;
};

class BackwardEulerScheme : public Implicit {
public:
    using Implicit::Implicit;
    const StepReport& step(State& state, double dt, const StepLoads& loads) override
    {
        return newton_.step(state, dt, {loads.potentials, loads.boundary(1)});
    }
};

class Statics : public Implicit {
public:
    using Implicit::Implicit;
    const StepReport& step(State& state, double, const StepLoads& loads) override
    {
        state.v.assign(state.v.size(), Vec3::Zero());
        return newton_.step(state, std::numeric_limits<double>::infinity(), {loads.potentials, loads.boundary(1)});
    }
};

/// to = from + factor (to - from).
void extrapolate(const State& from, double factor, State& to)
{
    eachNode<double>(to.x.size(), [&](std::size_t i) {
        to.x[i] = from.x[i] + factor * (to.x[i] - from.x[i]);
        to.v[i] = from.v[i] + factor * (to.v[i] - from.v[i]);
    });
}

class Midpoint : public Implicit {
public:
    Midpoint(const ElasticOperator& elastic, const NewtonSettings& settings)
        : Implicit(elastic, settings), elastic_(&elastic)
    {
    }
    void rebind(const ElasticOperator& elastic) override
    {
        Implicit::rebind(elastic);
        elastic_ = &elastic;
    }

    const StepReport& step(State& state, double dt, const StepLoads& loads) override
    {
        start_ = state;
        targets_ = loads.boundary(1).target;
        middle_ = loads.boundary(0.5);
        eachNode<double>(targets_.size(),
                         [&](std::size_t i) { middle_.target[i] = 0.5 * (start_.x[i] + targets_[i]); });
        report_ = newton_.step(state, 0.5 * dt, {loads.potentials, middle_});
        extrapolate(start_, 2, state);
        // What is held has the velocity of its step: doubling it would ring on, and load the grips with it.
        eachNode<double>(targets_.size(), [&](std::size_t i) {
            if (middle_.fixed[i]) state.x[i] = targets_[i], state.v[i] = (targets_[i] - start_.x[i]) / dt;
        });
        report_.elasticEnergy = elastic_->evaluate(state.x, {}, nullptr);
        return report_;
    }

    std::size_t bytes() const override { return Implicit::bytes() + 6 * start_.x.capacity() * sizeof(Vec3); }

private:
    const ElasticOperator* elastic_;
    State start_;
    std::vector<Vec3> targets_;
    Boundary middle_;
    StepReport report_;
};

class Sdirk2 : public Implicit {
public:
    using Implicit::Implicit;
    const StepReport& step(State& state, double dt, const StepLoads& loads) override
    {
        constexpr double gamma = 1 - std::numbers::sqrt2 / 2;
        start_ = state;
        first_ = newton_.step(state, gamma * dt, {loads.potentials, loads.boundary(gamma)});
        extrapolate(start_, (1 - gamma) / gamma, state);
        report_ = newton_.step(state, gamma * dt, {loads.potentials, loads.boundary(1)});
        add(first_);
        return report_;
    }

    std::size_t bytes() const override { return Implicit::bytes() + 4 * start_.x.capacity() * sizeof(Vec3); }

private:
    void add(const StepReport& first)
    {
        if (first.status == StepStatus::capped) report_.status = StepStatus::capped;
        report_.newtonIterations += first.newtonIterations;
        report_.linearIterations += first.linearIterations;
        report_.multigridSystems += first.multigridSystems;
        report_.projections += first.projections;
        report_.lineSearchSteps += first.lineSearchSteps;
        report_.creases += first.creases;
        report_.residual = std::max(report_.residual, first.residual);
        report_.minResidual = std::max(report_.minResidual, first.minResidual);
    }

    State start_;
    StepReport first_, report_;
};

/// Both explicit schemes. Forces of potentials are those at x0 + dt v0: what damps sees v0 there, and what does not is
/// as near to x0.
class Explicit : public Integrator {
public:
    Explicit(const ElasticOperator& elastic, bool symplectic)
        : elastic_(&elastic), symplectic_(symplectic), fastest_(elastic.highestFrequency())
    {
    }

    /// Tets only go, so what bounded their frequencies still does; an eigenvalue of each tet takes longer than many
    /// steps.
    void rebind(const ElasticOperator& elastic) override
    {
        elastic_ = &elastic;
        evaluated_ = false;
    }

    /// v += -dt (w^2 x + d v), x += dt v does not grow where (w dt)^2 + 2 d dt <= 4. Forward Euler grows anyway.
    bool isExplicit() const override { return true; }
    double largestStep(std::span<Potential* const> potentials, std::span<const Vec3> x) const override
    {
        constexpr double kReserve = 0.8;  // springs stretched to twice their length vibrate a quarter faster
        std::vector<Coupling> couplings;
        for (const Potential* p : potentials) p->linearize(x, couplings);
        const double w =
            couplings.empty() ? fastest_ : std::hypot(fastest_, highestFrequency(couplings, elastic_->mass()));
        double d = 0;
        for (const Potential* p : potentials) d += p->damping().mass + p->damping().stiffness * fastest_ * fastest_;
        return kReserve * 4 / (d + std::sqrt(d * d + 4 * w * w));
    }

    const StepReport& step(State& state, double dt, const StepLoads& loads) override
    {
        if (!evaluated_) evaluate(state.x);
        const Boundary& boundary = loads.boundary(1);
        addOuter(state, dt, loads.potentials);
        move(state, dt, boundary);
        evaluate(state.x);
        report_.elasticEnergy = energy_;
        report_.residual = std::isfinite(energy_) ? 0 : std::numeric_limits<double>::infinity();
        return report_;
    }

    std::size_t bytes() const override { return 4 * gradient_.capacity() * sizeof(Vec3); }

private:
    void evaluate(std::span<const Vec3> x)
    {
        gradient_.assign(x.size(), Vec3::Zero());
        energy_ = elastic_->evaluate(x, gradient_, nullptr);
        evaluated_ = true;
    }

    void addOuter(const State& state, double dt, std::span<Potential* const> potentials)
    {
        predicted_.resize(state.x.size());
        outer_.assign(state.x.size(), Vec3::Zero());
        eachNode<double>(state.x.size(), [&](std::size_t i) { predicted_[i] = state.x[i] + dt * state.v[i]; });
        for (Potential* potential : potentials) {
            potential->begin({state.x, state.v, dt, *elastic_});
            (void)potential->evaluate(predicted_, outer_);
        }
    }

    void move(State& state, double dt, const Boundary& boundary)
    {
        const std::span<const double> mass = elastic_->mass();
        report_.reaction.resize(state.x.size());
        eachNode<double>(state.x.size(), [&](std::size_t i) {
            const Vec3 force = boundary.force[i] - gradient_[i] - outer_[i], old = state.v[i];
            if (boundary.fixed[i]) {
                state.v[i] = (boundary.target[i] - state.x[i]) / dt;
                state.x[i] = boundary.target[i];
                report_.reaction[i] = mass[i] / dt * (state.v[i] - old) - force;
                return;
            }
            state.v[i] += dt / mass[i] * force;
            state.x[i] += dt * (symplectic_ ? state.v[i] : old);
            report_.reaction[i].setZero();
        });
    }

    const ElasticOperator* elastic_;
    bool symplectic_, evaluated_ = false;
    double fastest_, energy_ = 0;                     // 1/s, J
    std::vector<Vec3> gradient_, outer_, predicted_;  // N at x; N; m
    StepReport report_;
};

}  // namespace

std::unique_ptr<Integrator> makeIntegrator(Scheme scheme, const ElasticOperator& elastic,
                                           const NewtonSettings& settings)
{
    switch (scheme) {
    case Scheme::midpoint: return std::make_unique<Midpoint>(elastic, settings);
    case Scheme::sdirk2: return std::make_unique<Sdirk2>(elastic, settings);
    case Scheme::symplecticEuler: return std::make_unique<Explicit>(elastic, true);
    case Scheme::forwardEuler: return std::make_unique<Explicit>(elastic, false);
    case Scheme::statics: return std::make_unique<Statics>(elastic, settings);
    case Scheme::backwardEuler: break;
    }
    return std::make_unique<BackwardEulerScheme>(elastic, settings);
}

}  // namespace vdbfrac::solver
