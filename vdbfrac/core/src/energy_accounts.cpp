// Where the energy of the steps comes from and goes: docs/physics.md.
#include <vdbfrac/core/simulation.h>

#include "grips.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::core {

double energyOfNoise(std::span<const Body> bodies)
{
    constexpr double kStrain = 1e-7;
    double sum = 0;
    for (const Body& body : bodies) sum += kStrain * kStrain * body.material.youngsModulus() * body.startVolume;
    return sum;
}

namespace {

/// Of the most that was in it by all works: whoever has more energy has it from the integrator. What stores energy and
/// gives it back, as contact does, has put in nothing.
constexpr double kFlownApart = 100;

}  // namespace

void Simulation::beginEnergy()
{
    kineticEnergy_ = kineticEnergy(state_.v);
    putIn_ = netIn_ = mostIn_ = kineticEnergy_ + energyOfNoise(bodies_);
    // At rest, and nothing pulls yet.
    const auto& force = grips_->boundary(0).force;
    balanced_ = stages_.solve.empty() && stages_.flow.empty() && kineticEnergy_ == 0 &&
                std::all_of(force.begin(), force.end(), [](const Vec3& f) { return f == Vec3::Zero(); });
}

/// Books what grips, potentials and the integrator did to the energy, each by its own formula, and what of its change
/// none of them explains.
/// `after`: the operator of what is stored when the step is over. Where material flows the energy of the step is
/// another, `startEnergy` [J] at its start: what is less at once when it begins, and when it is over, is dissipated.
void Simulation::book(StepRecord& record, const solver::StepReport& report, const solver::ElasticOperator& after,
                      double startEnergy)
{
    auto& flow = record.energyFlow;
    const solver::StepEnergy& energy = integrator_->energy();
    const Grips::Works works =
        grips_->work({saved_.x, state_.x, record.time - record.dt, record.time}, report.reaction, energy.legs);
    double in = 0, integrator = energy.loss - (energy.seesEnd ? works.late : 0);
    const auto put = [&](const std::string& name, double work) {
        flow[name] += work, in += work;
        putIn_ += std::max(work, 0.);
    };
    for (const auto& [grip, work] : works.ofGrips) put("work_" + grip, work);
    for (std::size_t i = 0; i < energy.flows.size(); ++i) {
        const solver::EnergyFlow& own = energy.flows[i];
        if (own.work != 0) put(potentialNames_[i] + "_work", own.work);
        if (own.dissipated != 0) flow[potentialNames_[i] + "_dissipated"] += own.dissipated;
        in -= own.dissipated;
        integrator += own.loss;
    }
    record.kineticEnergy = kineticEnergy(state_.v);
    record.elasticEnergy = report.elasticEnergy;
    if (!stages_.flow.empty()) {
        record.elasticEnergy = after.evaluate(state_.x, {}, nullptr);
        const double dissipated = elasticEnergy_ - startEnergy + report.elasticEnergy - record.elasticEnergy;
        flow[flowNames_.front() + "_dissipated"] += dissipated, in -= dissipated;
    }
    flow["integrator"] = integrator;
    const double left =
        in - integrator - (record.kineticEnergy - kineticEnergy_) - (record.elasticEnergy - elasticEnergy_);
    flow["unnamed"] = left;
    unnamed_ += left;
    record.unnamedShare = std::abs(unnamed_) / putIn_;
    netIn_ += in;
    mostIn_ = std::max(mostIn_, netIn_);
    // The first step of an explicit scheme moves nothing yet that work could be done on.
    if (integrator_->isExplicit() && steps_ > 1 && record.kineticEnergy + record.elasticEnergy > kFlownApart * mostIn_)
        record.outcome = Outcome::capped;
    elasticEnergy_ = record.elasticEnergy;
}

double Simulation::kineticEnergy(std::span<const Vec3> v) const
{
    const auto mass = elastic_->mass();
    return orderedSum(mass.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += 0.5 * mass[i] * v[i].squaredNorm();
        return sum;
    });
}

}  // namespace vdbfrac::core
