// What the law of fracture promises without a crack, and what became of all energy.
#include "newtons.h"

#include <vdbfrac/lab/samples/loads.h>

#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

/// J that backward Euler takes: |v1 - v0|_M^2 / 2 of each step (docs/physics.md).
class SpeedChanges : public core::Effect, public core::Observer {
public:
    std::string name() const override { return "speed_changes"; }
    void join(core::Stages& stages) override { stages.observers.push_back(this); }
    void observe(const core::SolvedStep& step) override
    {
        const auto mass = simulation_->elastic().mass();
        for (std::size_t i = 0; i < x_.size(); ++i)
            energy_ += .5 * mass[i] * ((step.x[i] - x_[i]) / step.dt - v_[i]).squaredNorm();
    }
    /// Before each step.
    void watch(const core::Simulation& simulation)
    {
        simulation_ = &simulation;
        x_.assign(simulation.x().begin(), simulation.x().end());
        v_.assign(simulation.v().begin(), simulation.v().end());
    }
    double energy() const { return energy_; }

private:
    const core::Simulation* simulation_ = nullptr;
    std::vector<Vec3> x_, v_;
    double energy_ = 0;
};

/// A square bar along y, 1 m of it free, none of its long faces on a plane of voxels.
struct SmoothBar {
    static constexpr double kStrength = 1.5e4, kGc = 300, kSide = .28125;  // Pa, J/m^2, m
    static constexpr int kVoxels = 16;                                     // in a metre

    double strain = NAN, load = 0;  // where it tears

    void pull()
    {
        constexpr int kFrames = 61;
        constexpr double kFrom = .85, kTo = 1.1;  // of the strain at the strength
        Specimen s;
        s.h = 1. / kVoxels, s.frames = kFrames;
        s.shape = boxKeys({kSide, 1.5, kSide}, Vec3::Zero());
        const Vec3 way(0, kTo * kStrength / kYoungsModulus / 2, 0);
        for (double side : {1., -1.})
            s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .5),
                           Ramp{kFrom / kTo, kFrames}.keys(side * way));
        s.rest += toughness(kGc) + format("strength = %g\n", kStrength);
        SceneRun run(s.text());
        while (!run.atEnd() && run.work.countOf("cut", "voxels") == 0) {
            load = std::max(load, run.step().gripLoad[0].y());
            const double t = run.steps.back().time;
            strain = kStrength / kYoungsModulus * (kFrom + (kTo - kFrom) * (t - 1) / (kFrames - 1));
        }
        if (run.work.countOf("cut", "voxels") == 0) strain = NAN;
    }
};

/// Share of the work put in that no account names, in a plate with a slit that is torn in two.
double unnamed(bool isStatic)
{
    constexpr int kFrames = 60;
    Specimen s;
    s.frames = kFrames, s.nu = .3, s.fps = 100, s.substeps = isStatic ? "1" : "4";
    if (!isStatic) s.solver = "newton_tolerance = 1e-4";
    s.shape = boxKeys({1, 1.4, .2}, Vec3::Zero()) + cutKeys({1, .06, 1}, {-.65, 0, 0});
    for (double side : {1., -1.})
        s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .5),
                       format("velocity = [0, %g, 0]", .05 * side));
    s.rest += "[damping]\nstiffness = 0.0005\n" + toughness();
    SpeedChanges changes;
    SceneRun run(s.text(), {}, &changes);
    double work = 0, left = 0;
    while (!run.atEnd()) {
        changes.watch(run.simulation);
        const core::StepRecord& step = run.step();
        work += workOf(step), left += flowOf(step, "integrator");
    }
    return (left - (isStatic ? 0 : changes.energy())) / work;
}

}  // namespace

Measurements smoothBar(Extent)
{
    constexpr double kLimit = .01;
    SmoothBar bar;
    bar.pull();
    constexpr double kStrength = SmoothBar::kStrength;
    return {within("stress in it when it tears, Pa", bar.strain * kYoungsModulus, kStrength, kLimit * kStrength),
            within("load over section, Pa", bar.load / (SmoothBar::kSide * SmoothBar::kSide), kStrength,
                   kLimit * kStrength)};
}

Measurements energyLedger(Extent)
{
    constexpr double kLimit = .01;
    return {within("static: share of the work that no account names", unnamed(true), 0, kLimit),
            within("backward Euler: share of the work that no account names", unnamed(false), 0, kLimit)};
}

}  // namespace vdbfrac::lab::verify
