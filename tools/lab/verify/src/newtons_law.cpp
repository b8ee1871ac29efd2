// What the law of fracture promises without a crack, and what became of all energy.
#include "newtons.h"

#include <cmath>
#include <utility>

namespace vdbfrac::lab::verify {

namespace {

/// J that backward Euler takes, found anew: |v1 - v0|_M^2 / 2, and how far the elastic energy lies above its tangent
/// plane at the end of the step. What it reckons the work of grips too low or too high by is theirs to add: their
/// forces at the end count in full for the solve, and by half for the work.
class EulerLoss : public core::Effect, public core::Observer {
public:
    std::string name() const override { return "euler_loss"; }
    void join(core::Stages& stages) override { stages.observers.push_back(this); }
    void observe(const core::SolvedStep& step) override
    {
        const solver::ElasticOperator& elastic = simulation_->elastic();
        std::vector<Vec3> gradient(x_.size(), Vec3::Zero());
        energy_ += elastic.evaluate(x_, {}, nullptr) - elastic.evaluate(step.x, gradient, nullptr);
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const Vec3 way = step.x[i] - x_[i];
            energy_ += gradient[i].dot(way) + .5 * elastic.mass()[i] * (way / step.dt - v_[i]).squaredNorm();
        }
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
    static constexpr double kStrength = 1.5e4, kGc = 160, kSide = .28125;  // Pa, J/m^2, m
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

/// Energies of a plate with a slit that is torn in two, as shares of all work that was put in.
struct TornPlate {
    double unnamed = 0;  // the most of any step
    double euler = 0;    // what backward Euler took by its witness, less what the record says

    void tear(const char* integrator)
    {
        constexpr double kSpeed = .05;  // m/s
        const bool isStatic = integrator == std::string("static");
        Specimen s;
        s.frames = 60, s.nu = .3, s.fps = 100, s.substeps = isStatic ? "1" : "4";
        s.solver = format("integrator = \"%s\"\nnewton_tolerance = %g", integrator, isStatic ? 1e-4 : 1e-5);
        s.shape = boxKeys({1, 1.4, .2}, Vec3::Zero()) + cutKeys({1, .06, 1}, {-.65, 0, 0});
        for (double side : {1., -1.})
            s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .5),
                           format("velocity = [0, %g, 0]", kSpeed * side));
        s.rest += "[damping]\nstiffness = 0.0005\n" + toughness();
        EulerLoss loss;
        SceneRun run(s.text(), {}, &loss);
        double work = 0, left = 0, pull = 0;  // J, J, N
        while (!run.atEnd()) {
            loss.watch(run.simulation);
            const core::StepRecord& step = run.step();
            const double before = std::exchange(pull, step.gripLoad[0].y() - step.gripLoad[1].y());
            work += workOf(step), left += flowOf(step, "integrator") + .5 * (pull - before) * kSpeed * step.dt;
            unnamed = std::max(unnamed, step.unnamedShare);
        }
        euler = (loss.energy() - left) / work;
    }
};

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

Measurements energyLedger(Extent extent)
{
    constexpr double kLimit = .01;
    Measurements all;
    for (const char* integrator : {"static", "backward_euler", "midpoint", "sdirk2"}) {
        const bool isEuler = integrator == std::string("backward_euler");
        if (extent == Extent::quick && !isEuler && integrator != std::string("static")) continue;
        TornPlate plate;
        plate.tear(integrator);
        all.push_back(within(format("%s: share of the work that no account names, most of all steps", integrator),
                             plate.unnamed, 0, kLimit));
        if (isEuler)
            all.push_back(within("backward_euler: what it took, less what a fresh sum finds, over the work",
                                 plate.euler, 0, kLimit));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
