// Measures that add up work: of a grip, and what is left of all the work that was done.
#include "measures.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::study {

namespace {

using Measure = scene::Study::Measure;

/// Grips that turn do work by torques too, and a run tells loads alone.
bool turns(const scene::Grip& grip)
{
    const auto* keys = std::get_if<scene::Keys>(&grip.move);
    return keys && std::any_of(keys->keys.begin(), keys->keys.end(),
                               [&](const scene::PoseKey& k) { return k.rotate != keys->keys[0].rotate; });
}

/// Work [J] of a grip that moves without turning, or pulls with a force: the mean of its loads at both ends of a step,
/// times how far its nodes moved (the mean by mass). The first step has its own load only.
class GripWork {
public:
    explicit GripWork(std::size_t grip) : grip_(grip) {}

    void solved(const core::Simulation& simulation, std::span<const Vec3> before, std::span<const Vec3> x)
    {
        const auto mass = simulation.elastic().mass();
        double total = 0;
        moved_ = Vec3::Zero();
        for (const std::uint32_t n : simulation.gripNodes(grip_))
            moved_ += mass[n] * (x[n] - before[n]), total += mass[n];
        if (total > 0) moved_ /= total;
    }
    void step(const core::StepRecord& record)
    {
        const Vec3& load = record.gripLoad[grip_];
        work_ += .5 * (load_.value_or(load) + load).dot(moved_);
        load_ = load;
    }
    double work() const { return work_; }

private:
    std::size_t grip_;
    Vec3 moved_ = Vec3::Zero();
    std::optional<Vec3> load_;
    double work_ = 0;
};

/// Work of grips and of potentials, and with it what is left of the work and the energy there was at the start.
class Works : public Witness {
public:
    Works(const Measure& measure, const scene::Scene& scene) : quantity_(measure.quantity)
    {
        const bool one = quantity_ == "load_work";
        for (std::size_t g = 0; g < scene.grips.size(); ++g) {
            if (one && g != gripIndex(measure, scene)) continue;
            if (turns(scene.grips[g])) turning_ = scene.grips[g].name;
            grips_.emplace_back(g);
        }
    }

    void start(const core::Simulation& s) override
    {
        const core::Stages& stages = s.stages();
        loses_ = std::any_of(stages.grid.begin(), stages.grid.end(),
                             [](const core::GridStage* stage) { return stage->dissipates(); }) ||
                 std::any_of(stages.solve.begin(), stages.solve.end(),
                             [](const solver::Potential* p) { return !p->isConservative(); });
        x_.assign(s.x().begin(), s.x().end());
        const auto mass = s.elastic().mass();
        energy_ = s.elastic().evaluate(x_, {}, nullptr);
        for (std::size_t i = 0; i < mass.size(); ++i) energy_ += .5 * mass[i] * s.v()[i].squaredNorm();
        turnover_ = startEnergy_ = energy_;
    }

    bool looksAtSolves() const override { return true; }

    void solved(const core::Simulation& s, std::span<const Vec3> x) override
    {
        for (GripWork& grip : grips_) grip.solved(s, x_, x);
        gradient_.resize(x.size());  // is of no interest
        for (const solver::Potential* p : s.stages().solve)
            if (p->isConservative()) potentialWork_ += p->evaluate(x_, gradient_) - p->evaluate(x, gradient_);
    }

    void step(const core::Simulation& s, const core::StepRecord& record) override
    {
        for (GripWork& grip : grips_) grip.step(record);
        x_.assign(s.x().begin(), s.x().end());
        energy_ = record.kineticEnergy + record.elasticEnergy;
        turnover_ = std::max(turnover_, energy_);
    }

    Value end(const core::Simulation&, const core::StepRecord&) override
    {
        if (!turning_.empty()) return missing("grip '" + turning_ + "' turns: its torque is not known");
        double work = 0;
        for (const GripWork& grip : grips_) work += grip.work();
        if (quantity_ == "load_work") return number(work);
        const double lost = work + potentialWork_ - (energy_ - startEnergy_);
        if (quantity_ == "dissipated") return number(lost);
        if (loses_) return missing("an effect of the scene takes energy; measure 'dissipated'");
        return number(turnover_ > 0 ? -lost / turnover_ : 0);
    }

private:
    std::string quantity_, turning_;
    bool loses_ = false;  // an effect may take energy
    std::vector<GripWork> grips_;
    std::vector<Vec3> x_, gradient_;
    double potentialWork_ = 0, energy_ = 0, startEnergy_ = 0, turnover_ = 0;
};

}  // namespace

std::unique_ptr<Witness> makeWorkWitness(const Measure& measure, const scene::Scene& scene)
{
    const std::string& q = measure.quantity;
    if (q == "load_work" || q == "dissipated" || q == "energy_balance") return std::make_unique<Works>(measure, scene);
    return nullptr;
}

}  // namespace vdbfrac::lab::study
