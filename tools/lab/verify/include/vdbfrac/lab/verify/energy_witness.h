// Looks at a step between its solve and its changes of the level set, where nothing else can.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <optional>
#include <vector>

namespace vdbfrac::lab::verify {

/// Energies [J] and forces [N] of a solved step, computed anew of positions alone, on the mesh it was solved on.
struct StepBalance {
    double kinetic = 0, elastic = 0;  ///< at the end
    double growth = 0;                ///< of kinetic, elastic and potential energy, beyond the work of grips and forces
    double turnover = 0;              ///< sum of the magnitudes that growth was added from
    double nonconvex = 0;             ///< how far E(x0) and the potentials at x0 lie below their tangent planes at x1
    double openWork = 0;              ///< what free nodes may have moved against a residual of tolerance 1
    double rounding = 0;              ///< of growth
    double forceRounding = 0;         ///< N, of a sum of forces
    double unaveraged = 0;            ///< elastic energy without mean dilatation, where material may go
    std::vector<Vec3> gripLoad;       ///< N, of each grip
};

/// An effect that does nothing but look on.
class EnergyWitness : public core::Effect, public core::Observer {
public:
    std::string name() const override { return "witness"; }
    void join(core::Stages& stages) override { stages.observers.push_back(this); }
    void observe(const core::SolvedStep& step) override;

    /// Before each step. Both must live until its end.
    void watch(const core::Simulation& simulation, const scene::Scene& scene);
    /// Of the step since watch().
    const StepBalance& balance() const { return balance_; }

private:
    struct Held;  // what grips do to the nodes

    Held held() const;

    const core::Simulation* simulation_ = nullptr;
    const scene::Scene* scene_ = nullptr;
    std::vector<Vec3> x_, v_;  // at the start of the step
    double time_ = 0;
    StepBalance balance_;
};

}  // namespace vdbfrac::lab::verify
