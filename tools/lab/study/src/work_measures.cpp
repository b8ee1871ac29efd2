// Measures that add up what the steps book: work of a grip, and what became of all the work that was done.
#include "measures.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::study {

namespace {

using Measure = Spec::Measure;

/// The energies of a run, added up from what its steps book.
class Works : public Witness {
public:
    Works(const Measure& measure, const scene::Scene& scene) : quantity_(measure.quantity)
    {
        if (quantity_ == "load_work") grip_ = "work_" + scene.grips[gripIndex(measure, scene)].name;
    }

    void start(const core::Simulation& s) override
    {
        const auto mass = s.elastic().mass();
        for (std::size_t i = 0; i < mass.size(); ++i) turnover_ += .5 * mass[i] * s.v()[i].squaredNorm();
    }
    void step(const core::Simulation&, const core::StepRecord& record) override
    {
        for (const auto& [name, amount] : record.energyFlow) {
            if (name == grip_) gripWork_ += amount;
            if (name == "integrator") integrator_ += amount;
            const bool isOfEffect = !name.starts_with("work_");  // not of a grip with such a name
            if (name == "integrator" || name == "removed" || (isOfEffect && name.ends_with("_dissipated")))
                dissipated_ += amount;
        }
        turnover_ = std::max(turnover_, record.kineticEnergy + record.elasticEnergy);
    }
    Value end(const core::Simulation&, const core::StepRecord& last) override
    {
        if (quantity_ == "load_work") return number(gripWork_);
        if (last.unnamedShare > core::kMaxUnnamedShare) return missing("energy without account");
        if (quantity_ == "dissipated") return number(dissipated_);
        return number(turnover_ > 0 ? -integrator_ / turnover_ : 0);
    }

private:
    std::string quantity_, grip_;
    double gripWork_ = 0, dissipated_ = 0, integrator_ = 0, turnover_ = 0;  // J
};

}  // namespace

std::unique_ptr<Witness> makeWorkWitness(const Measure& measure, const scene::Scene& scene)
{
    const std::string& q = measure.quantity;
    if (q == "load_work" || q == "dissipated" || q == "energy_balance") return std::make_unique<Works>(measure, scene);
    return nullptr;
}

}  // namespace vdbfrac::lab::study
