// Fragments that are asleep: held where they are, and left out of all passes over the elements.
#include <vdbfrac/core/simulation.h>

#include "grips.h"

#include <algorithm>

namespace vdbfrac::core {

/// Asks the stages what sleeps when a step is solved; has anything changed?
bool Simulation::askAsleep(double time, double dt, bool converged, AskAsleep ask)
{
    asleep_.resize(nextFragment_);
    const std::vector<std::uint8_t> before = asleep_, held = grips_->heldFragments(asleep_.size());
    const SleepContext context{{state_.x, time, dt}, bodies_, state_.v, elastic_->mass(), held, converged,
                               stages_.solve};
    for (SleepStage* stage : stages_.sleep) (stage->*ask)(context, asleep_);
    return asleep_ != before;
}

/// What a solve over dt [s] has struck in its sleep wakes. Has any?
bool Simulation::wakeStruck(double dt)
{
    if (fragmentsAsleep() == 0 || !askAsleep(time_ + dt, dt, true, &SleepStage::wake)) return false;
    changeAsleep();
    return true;
}

void Simulation::putToSleep(StepRecord& record, bool converged)
{
    const bool isChanged = askAsleep(time_, record.dt, converged, &SleepStage::decide);
    record.measured["asleep"] = double(fragmentsAsleep());
    if (!isChanged) return;
    for (const Body& body : bodies_)
        for (std::size_t i = 0; i < body.fragments.ofNode().size(); ++i)
            if (asleep_[body.fragments.ofNode()[i]]) state_.v[body.firstNode + i].setZero();
    const double moving = record.kineticEnergy;
    record.kineticEnergy = kineticEnergy(state_.v);
    record.energyFlow["sleep_dissipated"] = moving - record.kineticEnergy;
    changeAsleep();
}

void Simulation::changeAsleep()
{
    grips_->rebuild(bodies_, *elastic_);  // lets go of those that were
    holdAsleep();
    if (integrator_->isExplicit()) integrator_->rebind(*elastic_);  // it keeps forces from step to step
}

/// Those that are asleep are held where they are, and left out.
void Simulation::holdAsleep()
{
    asleep_.resize(nextFragment_);
    std::vector<std::uint8_t> nodes(state_.x.size(), 0);
    for (const Body& body : bodies_)
        for (std::size_t i = 0; i < body.fragments.ofNode().size(); ++i) {
            const std::uint32_t node = body.firstNode + std::uint32_t(i);
            nodes[node] = asleep_[body.fragments.ofNode()[i]];
            if (nodes[node]) grips_->hold(node, state_.x[node]);
        }
    elastic_->setAsleep(nodes);
}

void Simulation::letGoOfGrips()
{
    if (!grips_->letGo(time_)) return;
    grips_->rebuild(bodies_, *elastic_);
    grips_->requireNear(state_.x, time_);  // of those that held nodes too
    if (!asleep_.empty()) holdAsleep();
    balanced_ = false;
}

/// What is cut again is another piece than that which fell asleep.
void Simulation::wakeRecut(const Body& body, const tetmesh::CutUpdate& update)
{
    asleep_.resize(nextFragment_);
    for (const auto& r : update.previousElement.recut)
        asleep_[body.fragments.ofNode()[body.mesh->elements()[r.element].node[0]]] = 0;
    for (const tetmesh::Fragment& f : body.fragments.fragments())
        if (f.restVolume == 0) asleep_[f.id] = 0;  // cut away
}

/// What is asleep does not tear: it has no energy to those that ask for that.
void Simulation::clearAsleep(std::vector<double>& density) const
{
    if (fragmentsAsleep() == 0) return;
    std::size_t entry = 0;
    for (const Body& body : bodies_)
        for (const auto& e : body.mesh->elements()) {
            if (asleep_[body.fragments.ofNode()[e.node[0]]])
                std::fill_n(density.begin() + std::ptrdiff_t(entry), tetmesh::kMaxTets, 0.);
            entry += tetmesh::kMaxTets;
        }
}

std::size_t Simulation::fragmentsAsleep() const { return std::size_t(std::count(asleep_.begin(), asleep_.end(), 1)); }

}  // namespace vdbfrac::core
