#include <vdbfrac/lab/verify/scene_laws.h>

#include "cases.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/lab/verify/energy_witness.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

namespace vdbfrac::lab::verify {

namespace {

/// Roundings of a sum over the tets of a scene.
constexpr double kSumRounding = 1e-12;
/// Of the allowed residual: the shift that gives a free part its momentum back comes after it was measured.
constexpr double kResidualSlack = 3;
/// After so many products and evaluations of tets, or Newton iterations, a scene is left: some seconds of one core.
constexpr std::int64_t kMaxTets = 200'000'000, kMaxIterations = 1500;
constexpr std::int64_t kTetsOfSample = 1;  // what a pair that may touch takes, about

struct Broken {
    std::string what;
};

void require(bool holds, const char* law, double value, double limit)
{
    if (holds) return;
    throw Broken{fmt::format("{}: {:.6g}, allowed {:.6g}", law, value, limit)};
}

// NaN fails.
void requireAtMost(const char* law, double value, double limit) { require(value <= limit, law, value, limit); }

class LawfulRun {
public:
    LawfulRun(const std::string& scene, SceneOutcome& outcome)
        : run_(scene, {}, &witness_),
          drawing_(run_.scene, run_.simulation),
          outcome_(outcome),
          volume_(run_.simulation.startVolume())
    {
        outcome_.startVolume = outcome_.volume = volume_;
        requireFragments();
        drawing_.follow(run_.simulation, drawn_);
        isClosed_ = openEdges() == 0;
        requireNoBridges();
        if (run_.simulation.fragments() == 1)
            requireAtMost("torn faces before anything tears", double(drawn_.countOf("draw", "torn_faces")), 0);
    }

    /// One step and all that has to hold after it. False when the scene is over.
    bool step()
    {
        if (outcome_.cutShort || run_.atEnd()) return false;
        witness_.watch(run_.simulation, run_.scene);
        const core::StepRecord& record = run_.step();
        count(record);
        requireFinite(record);
        requireSolved(record);
        requireLess(record);
        requireFragments();
        return true;
    }

    /// What is drawn of the state that it ended in.
    void requireDrawn()
    {
        drawing_.follow(run_.simulation, drawn_);
        requireAtMost("gaps in what is drawn", double(drawn_.countOf("draw", "defects")), 0);
        if (isClosed_) requireAtMost("open edges of what is drawn", double(openEdges()), 0);
        requireNoBridges();
    }

    std::uint64_t hash() const { return run_.simulation.stateHash(); }

private:
    std::size_t openEdges() const
    {
        std::size_t open = 0;
        for (std::size_t b = 0; b < run_.scene.bodies.size(); ++b)
            open += tetmesh::examine(tetmesh::soupOf(drawing_.topology(b)->mesh)).openEdges;
        return open;
    }
    void requireNoBridges() const
    {
        requireAtMost("drawn faces between fragments", double(drawn_.countOf("draw", "bridges")), 0);
    }

    void count(const core::StepRecord& record)
    {
        ++outcome_.steps;
        ++(record.outcome == core::Outcome::converged ? outcome_.converged
           : record.outcome == core::Outcome::cutback ? outcome_.cutback
                                                      : outcome_.capped);
        iterations_ += record.newtonIterations;
        tets_ += record.work.countOf("solve", "evaluated_tets") + record.work.countOf("solve", "product_tets") +
                 kTetsOfSample * record.work.countOf("contact", "listed") * record.work.countOf("contact", "calls");
        outcome_.cutShort = tets_ > kMaxTets || iterations_ > kMaxIterations;
    }

    void requireFinite(const core::StepRecord& r) const
    {
        requireAtMost("positions and velocities that are not finite", notFiniteNodes(run_.simulation), 0);
        requireAtMost("loads that are not finite", countNotFinite(r.gripLoad), 0);
        for (double value : {r.time, r.dt, r.residual, r.kineticEnergy, r.elasticEnergy, r.volume})
            require(std::isfinite(value), "finite statistics", value, 0);
    }

    /// What the step ended at, before material went.
    void requireSolved(const core::StepRecord& record)
    {
        const StepBalance& b = witness_.balance();
        if (record.outcome == core::Outcome::capped) return;
        const double allowed = kResidualSlack * run_.scene.solver.newtonTolerance * b.openWork + b.rounding;
        outcome_.solveGain = std::max(outcome_.solveGain, (b.growth - allowed) / b.turnover);
        requireAtMost("energy beyond the work done", b.growth, allowed + b.nonconvex);
        double reported = record.kineticEnergy + record.elasticEnergy;
        for (const char* taken : {"removed", "sleep_dissipated"})
            if (const auto flow = record.energyFlow.find(taken); flow != record.energyFlow.end())
                reported += flow->second;
        // Where material flows, energy is given up at the start of a step too, which the witness does not see.
        const auto flowed = record.energyFlow.find("plasticity_dissipated");
        if (flowed == record.energyFlow.end() || flowed->second == 0)
            requireAtMost("reported energy", std::abs(reported - b.kinetic - b.elastic), b.rounding);
        for (std::size_t g = 0; g < b.gripLoad.size(); ++g)
            requireAtMost("reported load", (record.gripLoad[g] - b.gripLoad[g]).norm(),
                          kSumRounding * b.gripLoad[g].norm() + b.forceRounding);
    }

    /// Material only goes.
    void requireLess(const core::StepRecord& record)
    {
        const StepBalance& b = witness_.balance();
        requireAtMost("volume of the material", record.volume, volume_ * (1 + kSumRounding));
        volume_ = outcome_.volume = record.volume;
        if (record.work.countOf("cut", "voxels") == 0) return;
        const double elastic = run_.simulation.elastic().evaluate(run_.simulation.x(), {}, nullptr);
        requireAtMost("reported elastic energy after a cut", std::abs(record.elasticEnergy - elastic), b.rounding);
        outcome_.recutGain = std::max(outcome_.recutGain, (elastic - b.elastic - b.rounding) / b.turnover);
        requireAtMost("kinetic energy after a cut", record.kineticEnergy, b.kinetic * (1 + kSumRounding));
        if (record.work.countOf("flow", "elements") > 0) return;  // the witness saw what was to flow yet
        requireAtMost("elastic energy after a cut", elastic, b.unaveraged * (1 + kSumRounding) + b.rounding);
    }

    void requireFragments() const
    {
        const core::Simulation& simulation = run_.simulation;
        requireAtMost("material of no fragment", std::abs(fragmentVolume(simulation) - simulation.volume()),
                      kSumRounding * outcome_.startVolume);
    }

    EnergyWitness witness_;
    SceneRun run_;
    core::Drawing drawing_;
    Ledger drawn_;
    bool isClosed_ = false;  // what is drawn, at the start
    SceneOutcome& outcome_;
    double volume_;
    std::int64_t tets_ = 0, iterations_ = 0;
};

/// The state after as many steps on some threads, with nobody looking on.
std::uint64_t hashOnThreads(const std::string& scene, int threads, int steps)
{
    const ThreadLimit limit(threads);
    SceneRun run(scene);
    for (int n = 0; n < steps; ++n) run.step();
    return run.simulation.stateHash();
}

void runAll(const std::string& scene, bool compareThreads, SceneOutcome& outcome)
{
    std::optional<LawfulRun> run;
    try {
        run.emplace(scene, outcome);
    } catch (const InputError& error) {
        outcome.refused = true;
        outcome.refusal = error.what();
        return;
    }
    while (run->step()) {}
    run->requireDrawn();
    if (!compareThreads) return;
    const std::uint64_t hash = run->hash();
    for (int threads : {1, 2})
        require(hashOnThreads(scene, threads, outcome.steps) == hash, "same bits on another number of threads", threads,
                0);
}

}  // namespace

SceneOutcome runUnderLaws(const std::string& scene, bool compareThreads)
{
    const auto start = std::chrono::steady_clock::now();
    SceneOutcome outcome;
    const auto at = [&](const std::string& what) { return "step " + std::to_string(outcome.steps) + ": " + what; };
    try {
        runAll(scene, compareThreads, outcome);
    } catch (const Broken& broken) {
        outcome.broken = at(broken.what);
    } catch (const std::exception& error) {
        outcome.broken = at(std::string("error: ") + error.what());
    }
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return outcome;
}

}  // namespace vdbfrac::lab::verify
