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

void Integrator::beginEnergy(const StepLoads& loads)
{
    energy_.loss = 0;
    energy_.flows.assign(loads.potentials.size(), {});
    energy_.legs.clear();
    energy_.seesEnd = false;
}

/// Adds up what potentials did along a leg.
void Integrator::pass(const StepLoads& loads, const Leg& leg)
{
    for (std::size_t p = 0; p < loads.potentials.size(); ++p) {
        const EnergyFlow own = loads.potentials[p]->flow(leg);
        EnergyFlow& sum = energy_.flows[p];
        sum = {sum.work + own.work, sum.dissipated + own.dissipated, sum.loss + own.loss};
    }
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
        const StepReport& report =
            newton_.step(state, dt, {loads.potentials, loads.boundary(1), loads.time + dt, loads.time});
        if (loads.origin) {
            beginEnergy(loads);
            pass(loads, {loads.origin->state.x, state.x, state.x});
            energy_.loss =
                report.inertialLoss + report.elasticWork + loads.origin->elasticEnergy - report.elasticEnergy;
            energy_.seesEnd = true;
        }
        return report;
    }
};

class Statics : public Implicit {
public:
    Statics(const ElasticOperator& elastic, const NewtonSettings& settings)
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
        state.v.assign(state.v.size(), Vec3::Zero());
        const StepReport& report = newton_.step(state, std::numeric_limits<double>::infinity(),
                                                {loads.potentials, loads.boundary(1), loads.time + dt, loads.time});
        if (loads.origin) book(state, loads);
        return report;
    }

    std::size_t bytes() const override
    {
        return Implicit::bytes() +
               (between_.capacity() + gradient_.capacity() + mean_.capacity() + pushes_.capacity()) * sizeof(Vec3);
    }

private:
    void book(const State& state, const StepLoads& loads)
    {
        beginEnergy(loads);
        const StepOrigin& origin = *loads.origin;
        pass(loads, {origin.state.x, state.x, state.x});
        for (EnergyFlow& flow : energy_.flows) flow.loss = 0;  // it is in the forces that come to rest
        if (origin.balanced) return;
        averageForces(origin.state.x, state.x, loads.potentials);
        const Boundary& boundary = loads.boundary(0.5);
        const std::span<const double> mass = elastic_->mass();
        // What potentials do, which may move, they have told: on free nodes that less what they do on held ones.
        energy_.loss = nodeSum<double>(mean_.size(), [&](std::size_t i) {
            const double still = 0.5 * mass[i] * origin.state.v[i].squaredNorm();
            const Vec3 move = state.x[i] - origin.state.x[i], pull = mean_[i] - boundary.force[i];
            mean_[i] = pull + pushes_[i];
            return boundary.fixed[i] ? still + pushes_[i].dot(move) : still - pull.dot(move);
        });
        for (const EnergyFlow& flow : energy_.flows) energy_.loss += flow.work - flow.dissipated;
        energy_.legs.push_back({origin.state.x, state.x, mean_, 0.5});
        (void)loads.boundary(1);  // loads are told as of the end
    }

    /// Of elasticity, and of potentials, along the way.
    void averageForces(std::span<const Vec3> from, std::span<const Vec3> to, std::span<Potential* const> potentials)
    {
        mean_.assign(from.size(), Vec3::Zero()), pushes_.assign(from.size(), Vec3::Zero());
        between_.resize(from.size());
        for (const auto& [share, weight] : {std::pair(0., 1. / 6), std::pair(0.5, 4. / 6), std::pair(1., 1. / 6)}) {
            gradient_.assign(from.size(), Vec3::Zero());
            eachNode<double>(from.size(), [&](std::size_t i) { between_[i] = from[i] + share * (to[i] - from[i]); });
            (void)elastic_->evaluate(between_, gradient_, nullptr);
            eachNode<double>(from.size(), [&](std::size_t i) { mean_[i] += weight * gradient_[i]; });
            gradient_.assign(from.size(), Vec3::Zero());
            for (const Potential* p : potentials) (void)p->evaluate(between_, gradient_);
            eachNode<double>(from.size(), [&](std::size_t i) { pushes_[i] += weight * gradient_[i]; });
        }
    }

    const ElasticOperator* elastic_;
    std::vector<Vec3> between_, gradient_, mean_, pushes_;
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
        report_ = newton_.step(state, 0.5 * dt, {loads.potentials, middle_, loads.time + 0.5 * dt, loads.time});
        if (loads.origin) at_ = state.x;
        extrapolate(start_, 2, state);
        // What is held has the velocity of its step: doubling it would ring on, and load the grips with it.
        const std::span<const double> mass = elastic_->mass();
        const double heldLoss = nodeSum<double>(targets_.size(), [&](std::size_t i) {
            if (!middle_.fixed[i]) return 0.;
            state.x[i] = targets_[i], state.v[i] = (targets_[i] - start_.x[i]) / dt;
            return 0.5 * mass[i] * (state.v[i] - start_.v[i]).dot(3 * state.v[i] - start_.v[i]);
        });
        report_.elasticEnergy = elastic_->evaluate(state.x, {}, nullptr);
        if (loads.origin) {
            beginEnergy(loads);
            pass(loads, {start_.x, state.x, at_, 2});
            energy_.loss = heldLoss + 2 * report_.elasticWork + loads.origin->elasticEnergy - report_.elasticEnergy;
            energy_.legs.push_back({start_.x, state.x, report_.reaction, 0.5});
        }
        return report_;
    }

    std::size_t bytes() const override
    {
        return Implicit::bytes() + (6 * start_.x.capacity() + at_.capacity()) * sizeof(Vec3);
    }

private:
    const ElasticOperator* elastic_;
    State start_;
    std::vector<Vec3> targets_, at_;
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
        constexpr double beyond = (1 - gamma) / gamma;
        first_ = newton_.step(state, gamma * dt,
                              {loads.potentials, loads.boundary(gamma), loads.time + gamma * dt, loads.time});
        if (loads.origin) at_ = state.x;
        extrapolate(start_, beyond, state);
        if (loads.origin) {
            between_ = state.x;
            beginEnergy(loads);
            pass(loads, {start_.x, between_, at_, beyond});
        }
        report_ = newton_.step(state, gamma * dt,
                               {loads.potentials, loads.boundary(1), loads.time + dt, loads.time + (1 - gamma) * dt});
        if (loads.origin) {
            pass(loads, {between_, state.x, state.x, 1, false});
            energy_.loss = report_.inertialLoss - first_.inertialLoss + beyond * first_.elasticWork +
                           report_.elasticWork + loads.origin->elasticEnergy - report_.elasticEnergy;
            energy_.legs.push_back({start_.x, between_, first_.reaction, gamma});
            energy_.legs.push_back({between_, state.x, report_.reaction, 1});
        }
        add(first_);
        return report_;
    }

    std::size_t bytes() const override
    {
        return Implicit::bytes() + (4 * start_.x.capacity() + between_.capacity() + at_.capacity()) * sizeof(Vec3);
    }

private:
    void add(const StepReport& first)
    {
        if (first.status == StepStatus::capped && report_.status != StepStatus::capped)
            report_.status = StepStatus::capped, report_.worstNode = first.worstNode;
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
    std::vector<Vec3> between_, at_;
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
        evaluatedAt_.clear();
    }

    /// v += -dt (w^2 x + d v), x += dt v does not grow where (w dt)^2 + 2 d dt <= 4. Forward Euler grows anyway.
    bool isExplicit() const override { return true; }
    double largestStep(std::span<Potential* const> potentials, std::span<const Vec3> x) const override
    {
        constexpr double kReserve = 0.8;  // springs stretched to twice their length vibrate a quarter faster
        std::vector<Coupling> couplings;
        std::vector<ScalarCoupling> scalars;
        for (const Potential* p : potentials) p->linearize(x, couplings), p->linearizeScalars(x, *elastic_, scalars);
        const CouplingsOf all{couplings, scalars};
        const double w = all.empty() ? fastest_ : std::hypot(fastest_, highestFrequency(all, elastic_->mass()));
        double d = 0;
        for (const Potential* p : potentials) d += p->damping().mass + p->damping().stiffness * fastest_ * fastest_;
        return kReserve * 4 / (d + std::sqrt(d * d + 4 * w * w));
    }

    const StepReport& step(State& state, double dt, const StepLoads& loads) override
    {
        if (evaluatedAt_ != state.x) evaluate(state.x);  // after a step that was cut back it is another
        const Boundary& boundary = loads.boundary(1);
        addOuter(state, dt, loads);
        const double loss = move(state, dt, boundary);
        evaluate(state.x);
        report_.elasticEnergy = elasticEnergy_;
        report_.residual = std::isfinite(elasticEnergy_) ? 0 : std::numeric_limits<double>::infinity();
        if (loads.origin) {
            beginEnergy(loads);
            pass(loads, {loads.origin->state.x, state.x, predicted_});
            energy_.loss = loss + loads.origin->elasticEnergy - elasticEnergy_;
            energy_.legs.push_back({loads.origin->state.x, state.x, report_.reaction, 1});
        }
        return report_;
    }

    std::size_t bytes() const override { return 5 * gradient_.capacity() * sizeof(Vec3); }

private:
    void evaluate(std::span<const Vec3> x)
    {
        gradient_.assign(x.size(), Vec3::Zero());
        elasticEnergy_ = elastic_->evaluate(x, gradient_, nullptr);
        evaluatedAt_.assign(x.begin(), x.end());
    }

    void addOuter(const State& state, double dt, const StepLoads& loads)
    {
        predicted_.resize(state.x.size());
        outer_.assign(state.x.size(), Vec3::Zero());
        eachNode<double>(state.x.size(), [&](std::size_t i) { predicted_[i] = state.x[i] + dt * state.v[i]; });
        for (Potential* potential : loads.potentials) {
            potential->begin({state.x, state.v, dt, *elastic_, loads.time + dt, loads.time});
            (void)potential->evaluate(predicted_, outer_);
        }
    }

    /// Returns what the scheme takes, but for the change of the elastic energy [J].
    double move(State& state, double dt, const Boundary& boundary)
    {
        const std::span<const double> mass = elastic_->mass();
        report_.reaction.resize(state.x.size());
        return nodeSum<double>(state.x.size(), [&](std::size_t i) {
            const Vec3 force = boundary.force[i] - gradient_[i] - outer_[i], old = state.v[i], start = state.x[i];
            const bool fixed = boundary.fixed[i];
            if (fixed) {
                state.v[i] = (boundary.target[i] - state.x[i]) / dt;
                state.x[i] = boundary.target[i];
                report_.reaction[i] = mass[i] / dt * (state.v[i] - old) - force;
            } else {
                state.v[i] += dt / mass[i] * force;
                state.x[i] += dt * (symplectic_ ? state.v[i] : old);
                report_.reaction[i].setZero();
            }
            const double jump = 0.5 * mass[i] * (state.v[i] - old).squaredNorm();
            return (symplectic_ || fixed ? jump : -jump) + gradient_[i].dot(state.x[i] - start);
        });
    }

    const ElasticOperator* elastic_;
    bool symplectic_;
    double fastest_, elasticEnergy_ = 0;        // 1/s; J at evaluatedAt_
    std::vector<Vec3> evaluatedAt_, gradient_;  // m, N
    std::vector<Vec3> outer_, predicted_;       // N, m
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
