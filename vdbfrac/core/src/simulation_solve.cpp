// A time step of a simulation up to its new positions and velocities.
#include <vdbfrac/core/simulation.h>

#include "grips.h"
#include "step_control.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

namespace vdbfrac::core {

namespace {

constexpr const char* kTooFast =
    "are grips or bodies too fast, forces too large, or time steps too long for an explicit integrator?";

}  // namespace

/// What the tries of a step have come to.
struct Simulation::Attempt {
    double dt = 0;                               // s
    const solver::StepReport* report = nullptr;  // of the last try
    bool isSolved = false;
    double startEnergy = 0;  // J: elastic, as the step has it at its start, where material flows
};

/// Solves for the end of the next step, over `dt` [s] or what is left of it once it is halved as often as it takes,
/// from the saved state; never over less than `shortest` [s].
Simulation::Attempt Simulation::solveOrCutBack(StepRecord& record, double dt, double shortest)
{
    Attempt now{dt};
    solver::StepOrigin origin{saved_, elasticEnergy_, balanced_};
    const auto boundaryAt = [&](double share) -> const solver::Boundary& {
        return grips_->boundary(time_ + share * now.dt);
    };
    const auto solveOver = [&] {
        for (FlowStage* stage : stages_.flow) stage->begin(now.dt);
        if (!stages_.flow.empty()) origin.elasticEnergy = now.startEnergy = elastic_->evaluate(saved_.x, {}, nullptr);
        now.report = &integrator_->step(state_, now.dt, {stages_.solve, boundaryAt, &origin, time_});
        record.newtonIterations += now.report->newtonIterations;
        record.linearIterations += now.report->linearIterations;
        record.projections += now.report->projections;
        record.work.count("solve", "multigrid_systems", now.report->multigridSystems);
        record.work.count("solve", "creases", now.report->creases);
        const bool converged = now.report->status == solver::StepStatus::converged;
        if (!converged) tellUnsolved(now.report->worstNode, record.measured);
        now.isSolved = converged && isAdmissible(now.dt);
    };
    for (;; now.dt *= 0.5, ++record.cutbacks, state_ = saved_) {
        solveOver();
        while (now.isSolved && wakeStruck(now.dt)) state_ = saved_, solveOver();
        if (now.isSolved || 0.5 * now.dt < shortest) break;
    }
    if (!now.isSolved) wakeStruck(now.dt);
    return now;
}

void Simulation::solve(StepRecord& record, double until)
{
    const StageTimer timer(record.work, "solve");
    const StepControl::Choice choice =
        stepControl_->next(until - time_, {bodies_, state_, time_, stages_, *integrator_});
    if (!(time_ + choice.dt > time_))
        throw LimitError("step " + std::to_string(steps_ + 1) + ": a step of " + shortNumber(choice.dt, 3) +
                         " s is too small to advance the time " + shortNumber(time_, 6) + " s; " + kTooFast);
    const solver::ElasticWork before = elastic_->work();
    saved_ = state_;
    record.cutbacks = choice.halvings;
    const Attempt attempt = solveOrCutBack(record, choice.dt, choice.shortest);
    const solver::StepReport& report = *attempt.report;
    stepControl_->learn(choice.dt, attempt.dt);
    if (!std::isfinite(report.residual))
        throw LimitError("step " + std::to_string(steps_ + 1) +
                         ": forces or positions are beyond what a number can hold; " + kTooFast);
    record.dt = attempt.dt;
    record.time = time_ += attempt.dt;
    record.step = ++steps_;
    record.residual = report.residual;
    record.minResidual = report.minResidual;
    record.outcome = !attempt.isSolved                   ? Outcome::capped
                     : record.cutbacks > choice.halvings ? Outcome::cutback
                                                         : Outcome::converged;
    balanced_ = report.status == solver::StepStatus::converged;
    record.gripLoad = grips_->loads(report.reaction, time_);
    for (Observer* observer : stages_.observers) observer->observe({state_.x, time_, record.dt});
    std::unique_ptr<solver::ElasticOperator> flowed = letFlow(record.dt);
    book(record, report, flowed ? *flowed : *elastic_, attempt.startEnergy);
    for (solver::Potential* potential : stages_.solve) potential->accept(state_.x, time_, record.dt);
    countSolve(record, before, report.couplings);
    if (!stages_.sleep.empty()) putToSleep(record, balanced_);
    takeReports(record);
    if (!stages_.flow.empty()) balanced_ = false;  // the equations of the next step are others
    if (!flowed) return;
    elastic_ = std::move(flowed);  // potentials looked at the other one up to here
    bindOperator();
}

/// Once a step is kept. The operator of what has flowed then; null where nothing has.
std::unique_ptr<solver::ElasticOperator> Simulation::letFlow(double dt) const
{
    bool any = false;
    for (FlowStage* stage : stages_.flow) any |= stage->flow({state_.x, time_, dt}, *elastic_);
    return any ? makeOperator() : nullptr;
}

/// Where, at rest, forces are out of balance most.
void Simulation::tellUnsolved(std::uint32_t node, std::map<std::string, double>& measured) const
{
    const auto body = std::prev(std::ranges::upper_bound(bodies_, std::size_t(node), {}, &Body::firstNode));
    const Vec3 X = body->mesh->restPosition(node - std::uint32_t(body->firstNode));
    for (int axis = 0; axis < 3; ++axis) measured[std::string("unsolved_") + "xyz"[axis] + "_m"] = X[axis];
}

/// What the solve has cost since `before`.
void Simulation::countSolve(StepRecord& record, const solver::ElasticWork& before, std::size_t couplings) const
{
    const solver::ElasticWork& after = elastic_->work();
    record.work.count("solve", "evaluated_tets", after.evaluatedTets - before.evaluatedTets);
    record.work.count("solve", "product_tets", after.productTets - before.productTets);
    record.work.count("solve", "robust_tets", after.robustTets - before.robustTets);
    record.work.count("solve", "newton_iterations", record.newtonIterations);
    record.work.count("solve", "linear_iterations", record.linearIterations);
    if (couplings > 0) record.work.count("solve", "couplings", std::int64_t(couplings));
}

/// The time that reporters took within the solve is theirs.
void Simulation::takeReports(StepRecord& record) const
{
    for (Reporter* reporter : stages_.reporters) {
        Ledger own;
        reporter->report(own, record.measured);
        record.work.add(own);
        for (const StageWork& stage : own.stages()) record.work.addSeconds("solve", -stage.seconds);
    }
}

/// Does what a solve over dt [s] has come to pass with all potentials?
bool Simulation::isAdmissible(double dt) const
{
    const solver::WholeStep way{saved_.x, state_.x, time_, time_ + dt};
    return std::ranges::all_of(stages_.solve, [&](const solver::Potential* p) { return p->isAdmissible(way); });
}

}  // namespace vdbfrac::core
