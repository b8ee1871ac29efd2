// Bodies that are in each other when a scene begins.
#include "cases.h"
#include "scene_text.h"

#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <algorithm>
#include <string>
#include <vector>

namespace vdbfrac::lab::verify {

namespace {

constexpr int kSteps = 100;
constexpr double kVoxel = 0.1, kE = 1e5;  // m, Pa

/// Two blocks that share a third of their volume, and a ball in the middle of one of them. They come together at
/// `speed` [m/s] each, and turn.
std::string tangle(double nu, double speed)
{
    const auto body = [](const char* name, const char* shape, double velocity, double spin) {
        return format(
            "[[body]]\nname = \"%s\"\nmaterial = \"gel\"\nshape = { %s }\nvelocity = [0, %.5g, 0]\n"
            "angular_velocity = [0, 0, %.5g]\n",
            name, shape, velocity, spin);
    };
    return format(
               "version = 1\nname = \"tangle\"\n[time]\nframes = [1, %d]\nsubsteps = 1\n[grid]\nvoxel_size = %.5g\n"
               "[material.gel]\nyoungs_modulus = %.5g\npoisson_ratio = %.5g\ndensity = 1000\n[contact]\n",
               kSteps + 1, kVoxel, kE, nu) +
           body("lower", "box = { size = [0.8, 0.6, 0.6] }", speed, 0) +
           body("upper", "box = { size = [0.6, 0.6, 0.8], center = [0.17, 0.4, 0.06] }", -speed, speed) +
           body("ball", "sphere = { radius = 0.15, center = [-0.2, -0.05, 0.03] }", -speed, 0);
}

/// What a run came to, at the most.
struct Worst {
    double kinetic = 0, energy = 0;  // J: energy is kinetic and elastic
    double deeper = 0;               // cells beyond the depth after the first step
    double capped = 0, notFinite = 0;
    double putIn = 0;  // J: kinetic energy at the start
};

Worst run(double nu, double speed)
{
    SceneRun scene(tangle(nu, speed));
    Worst worst;
    const core::Simulation& s = scene.simulation;
    for (std::size_t i = 0; i < s.v().size(); ++i) worst.putIn += 0.5 * s.elastic().mass()[i] * s.v()[i].squaredNorm();
    double first = -1;
    while (!scene.atEnd()) {
        const core::StepRecord& r = scene.step();
        const double depth = r.measured.at("contact_depth_m");
        if (first < 0) first = depth;
        worst.kinetic = std::max(worst.kinetic, r.kineticEnergy);
        worst.energy = std::max(worst.energy, r.kineticEnergy + r.elasticEnergy);
        worst.deeper = std::max(worst.deeper, (depth - first) / kVoxel);
        worst.capped += r.outcome == core::Outcome::capped;
    }
    worst.notFinite = notFiniteNodes(s);
    return worst;
}

}  // namespace

Measurements tangledContact(Extent)
{
    constexpr double kVolume = 0.8 * 0.6 * 0.6;  // m^3, of one of them
    Measurements all;
    for (double nu : kPoissonRatios) {
        const Worst still = run(nu, 0), thrown = run(nu, 0.5);
        all.push_back(atMost(at(nu) + "at rest: kinetic energy, of E V", still.kinetic / (kE * kVolume), 1e-15));
        all.push_back(atMost(at(nu) + "at rest: deeper than at the start, cells", still.deeper, 1e-9));
        all.push_back(atMost(at(nu) + "thrown together: energy, of what was put in", thrown.energy / thrown.putIn, 1));
        all.push_back(atMost(at(nu) + "thrown together: deeper than at the start, cells", thrown.deeper, 0.1));
        all.push_back(atMost(at(nu) + "steps of 200 that are capped", still.capped + thrown.capped, 0));
        all.push_back(atMost(at(nu) + "nodes that are not finite", still.notFinite + thrown.notFinite, 0));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
