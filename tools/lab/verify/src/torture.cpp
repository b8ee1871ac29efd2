// Torture while tearing: bodies that are torn by what breaks simulations even when nothing tears.
#include "cases.h"

#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kVolume = 1e-12;  // relative; of sums over some thousand pieces

struct Block {
    const char *voxel, *size;
    const char* more = "";  ///< keys of the body
    double youngsModulus = 1e5;
};

/// A scene of one body, 1000 kg/m^3; grips, effects and other tables come after it. `time` and `grid` are contents of
/// those tables.
std::string sceneOf(const Block& block, double nu, const std::string& time, const std::string& grid = "")
{
    return "version = 1\nname = \"torture\"\ntime = { " + time + " }\ngrid = { voxel_size = " + block.voxel + grid +
           " }\n[[body]]\nname = \"block\"\nmaterial = \"m\"\nshape = { box = { size = " + block.size + " } }\n" +
           block.more + "\n[material.m]\ndensity = 1000\nyoungs_modulus = " + std::to_string(block.youngsModulus) +
           "\npoisson_ratio = " + std::to_string(nu) + "\n";
}

/// The part of the block with y >= offset, or -y >= offset for normal = -1.
std::string grip(int normal, double offset, const std::string& move)
{
    return "[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = [0, " + std::to_string(normal) +
           ", 0], offset = " + std::to_string(offset) + " } }\nmove = { " + move + " }\n";
}

std::string pulled(double offset, double speed)
{
    return grip(1, offset, "velocity = [0, " + std::to_string(speed) + ", 0]") +
           grip(-1, offset, "velocity = [0, " + std::to_string(-speed) + ", 0]");
}

/// Does the status of a step say what its numbers say?
bool isHonest(const core::StepRecord& s, const scene::Solver& solver)
{
    const bool cutBack = s.cutbacks > 0, solved = s.residual <= solver.newtonTolerance;
    return s.outcome == core::Outcome::capped || (solved && (s.outcome == core::Outcome::cutback) == cutBack);
}

/// What has to hold in any run, whatever is done to the body.
struct Account {
    double notFinite = 0;    ///< nodes, all steps together
    double grown = 0;        ///< steps in which material grows
    double strayVolume = 0;  ///< largest difference between fragments and material, of that at the start
    double dishonest = 0;    ///< steps whose status does not say what happened
    double capped = 0, steps = 0, tornVoxels = 0, fragments = 0;
    double startVolume = 0;  ///< m^3
    double unnamed = 0;      ///< energy that no account names, of what was put in; the largest of all steps
    double shortest = std::numeric_limits<double>::infinity();  ///< s: step
    double inOthers = 0, inColliders = 0;                       ///< m: deepest that a piece went into them
    double fromContact = 0, mostEnergy = 0;                     ///< J: given by it in all; kinetic and elastic
};

double measured(const core::StepRecord& s, const char* what)
{
    const auto found = s.measured.find(what);
    return found == s.measured.end() ? 0 : found->second;
}

Account runAndWatch(SceneRun& run)
{
    Account a;
    const core::Simulation& simulation = run.simulation;
    const double start = simulation.startVolume();
    double before = start;
    while (!run.atEnd()) {
        const core::StepRecord& s = run.step();
        a.notFinite += notFiniteNodes(simulation) + !std::isfinite(s.kineticEnergy + s.elasticEnergy + s.residual);
        a.grown += s.volume > before * (1 + kVolume);
        a.strayVolume = std::max(a.strayVolume, std::abs(fragmentVolume(simulation) - s.volume) / start);
        a.dishonest += !isHonest(s, run.scene.solver);
        a.capped += s.outcome == core::Outcome::capped;
        a.unnamed = std::max(a.unnamed, s.unnamedShare);
        a.shortest = std::min(a.shortest, s.dt);
        a.inOthers = std::max(a.inOthers, measured(s, "contact_depth_m"));
        a.inColliders = std::max(a.inColliders, measured(s, "collider_depth_m"));
        if (const auto work = s.energyFlow.find("contact_work"); work != s.energyFlow.end())
            a.fromContact += work->second;
        a.mostEnergy = std::max(a.mostEnergy, s.kineticEnergy + s.elasticEnergy);
        before = s.volume;
    }
    a.steps = double(run.steps.size());
    a.tornVoxels = double(run.work.countOf("fracture", "moved_voxels"));
    a.fragments = double(simulation.fragments()), a.startVolume = start;
    return a;
}

constexpr double kAnyCapped = -1;

/// The measurements that every tearing row has. `capped`: the most steps that may be.
void report(const std::string& name, const Account& a, double capped, Measurements& all)
{
    all.push_back(atMost(name + "numbers that are not finite", a.notFinite, 0));
    all.push_back(atMost(name + "steps in which material grows", a.grown, 0));
    all.push_back(atMost(name + "material of no fragment, of that at the start", a.strayVolume, kVolume));
    all.push_back(atMost(name + "steps whose status does not say what happened", a.dishonest, 0));
    if (capped != kAnyCapped)
        all.push_back(atMost(name + "capped steps, of " + std::to_string(int(a.steps)), a.capped, capped));
    all.push_back(atLeast(name + "voxels at which material went", a.tornVoxels, 1));
}

/// Keys of a grip at 1000 m/s where waves run at 10 m/s: twice the length up, down, up, down, and stopped at half;
/// later, half torn, all that once more.
std::string jerks()
{
    std::string keys = "keys = [{ time = 0 }";
    for (double start : {0., .025}) {
        constexpr std::pair<double, double> kPoses[] = {{6e-4, .6}, {12e-4, 0}, {18e-4, .6}, {24e-4, 0}, {27e-4, .3}};
        if (start > 0)
            keys += ", { time = " + std::to_string(start - 3e-4) +
                    ", translate = [0, 0.3, 0] }, { time = " + std::to_string(start) + " }";
        for (auto [time, y] : kPoses)
            keys += ", { time = " + std::to_string(start + time) + ", translate = [0, " + std::to_string(y) + ", 0] }";
    }
    return keys + "]";
}

constexpr double kBall = .12;  // m

/// A ball at twice the speed of waves, into a block.
std::string shotThrough(double nu)
{
    return sceneOf({"0.05", "[0.6, 0.6, 0.4]"}, nu, "frames = [1, 33], fps = 480") +
           "[contact]\n[fracture]\nkappa = 200\n[[collider]]\nshape = { sphere = { radius = " + std::to_string(kBall) +
           " } }\nmove = { keys = [{ time = 0, translate = [0.03, 0.02, -0.4] },\n"
           "{ time = 0.05, translate = [0.03, 0.02, 0.6] }] }\n";
}

/// A block between plates, to a third of its height and back.
std::string crushed(double nu)
{
    return sceneOf({"0.05", "[0.6, 0.6, 0.4]"}, nu, "frames = [1, 25]") +
           "[contact]\n[fracture]\nkappa = 2000\ndriver = \"full\"\n"
           "[[collider]]\nshape = { halfspace = { normal = [0, -1, 0], offset = 0.3 } }\n"
           "[[collider]]\nshape = { halfspace = { normal = [0, 1, 0], offset = 0.3 } }\n"
           "move = { keys = [{ time = 0 }, { time = 0.3, translate = [0, -0.4, 0] }, { time = 0.5 }] }\n";
}

/// Two blocks that meet at the speed of waves, one of them turning, with friction.
std::string thrownTogether(double nu)
{
    return sceneOf({"0.05", "[0.4, 0.6, 0.4], center = [-0.22, 0, 0]", "velocity = [5, 0, 0]\n"}, nu,
                   "frames = [1, 13], fps = 240") +
           "[[body]]\nname = \"other\"\nmaterial = \"m\"\nvelocity = [-5, 0, 0]\nangular_velocity = [0, 20, 0]\n"
           "shape = { box = { size = [0.4, 0.4, 0.4], center = [0.22, 0.1, 0.03] } }\n"
           "[contact]\nfriction = 0.5\n[fracture]\nkappa = 1000\n";
}

Account watch(const std::string& scene)
{
    SceneRun run(scene);
    return runAndWatch(run);
}

}  // namespace

Measurements jerkedGrips(Extent extent)
{
    Measurements all;
    for (double nu : kPoissonRatios) {
        const auto jerked = [&](const std::string& time) {
            return watch(sceneOf({"0.1", "[0.4, 0.6, 0.4]"}, nu, time) + grip(1, .2, jerks()) +
                         grip(-1, .2, "velocity = [0, 0, 0]") + "[fracture]\nkappa = 1e4\ngrip_margin = 0.05\n");
        };
        report(at(nu) + "half a cell a step: ", jerked("frames = [1, 1001], fps = 20000, substeps = 1"), 0, all);
        if (extent == Extent::full) report(at(nu) + "auto: ", jerked("frames = [1, 201], fps = 4000"), kAnyCapped, all);
    }
    return all;
}

Measurements resistanceGone(Extent)
{
    Measurements all;
    for (double nu : kPoissonRatios)
        for (const char* law : {"kappa = 1000", "toughness = 400"}) {
            const Account a =
                watch(sceneOf({"0.05", "[0.4, 0.6, 0.4]"}, nu, "frames = [1, 13]") + pulled(.2, .05) + "[fracture]\n" +
                      law + "\nkeys = [{ time = 0.2, scale = 1 }, { time = 0.21, scale = 1e-6 }]\n");
            report(at(nu) + law + ": ", a, 0, all);
        }
    return all;
}

Measurements coarseLattices(Extent)
{
    Measurements all;
    double volume = 0;
    for (double nu : kPoissonRatios)
        for (const char* coarsening : {"1", "2", "4"}) {
            const Account a = watch(sceneOf({"0.05", "[0.8, 1.2, 0.8]"}, nu, "frames = [1, 25]",
                                            std::string(", coarsening = ") + coarsening) +
                                    pulled(.5, .8) + "[fracture]\nkappa = 2000\ngrip_margin = 0.1\n");
            const std::string name = at(nu) + "coarsening " + coarsening + ": ";
            if (volume == 0) volume = a.startVolume;
            all.push_back(atMost(name + "material at the start against that of coarsening 1, relative",
                                 std::abs(a.startVolume / volume - 1), kVolume));
            all.push_back(atLeast(name + "fragments", a.fragments, 2));
            report(name, a, 0, all);
        }
    return all;
}

Measurements thinWalls(Extent)
{
    Measurements all;
    for (double nu : kPoissonRatios)
        for (const char* size : {"[0.8, 1, 0.05]", "[0.8, 1, 0.1]", "[0.8, 1, 0.15]"}) {
            const Account a =
                watch(sceneOf({"0.05", size}, nu, "frames = [1, 25]") + pulled(.4, .5) + "[fracture]\nkappa = 2000\n");
            all.push_back(atLeast(at(nu) + size + " m: fragments", a.fragments, 2));
            report(at(nu) + size + " m: ", a, 0, all);
        }
    return all;
}

Measurements touchingWhileTorn(Extent extent)
{
    constexpr double kCell = .05, kFrame = 1. / 480;  // m, s: the shortest of the frames
    // Pieces that fold into each other are not thrown apart: that would make energy of nothing.
    constexpr double kFolded = 1.5 * kCell, kGiven = .06;
    constexpr double kMiddle = kBall + .25 * kCell;  // how deep the middle of the ball is, with the gap that it keeps
    struct Touching {
        const char* name;
        std::string scene;
        double inOthers, inColliders;  // m: allowed
        double given;                  // 1: allowed
    };
    Measurements all;
    for (double nu : std::span(kPoissonRatios).subspan(extent == Extent::full ? 0 : 1))
        for (const Touching& t : {Touching{"shot: ", shotThrough(nu), kCell, kMiddle, kGiven},
                                  Touching{"crushed: ", crushed(nu), kCell, kCell, kGiven},
                                  Touching{"thrown together: ", thrownTogether(nu), kFolded, 0, kGiven}}) {
            const Account a = watch(t.scene);
            const std::string name = at(nu) + t.name;
            all.push_back(atMost(name + "in other pieces, cells", a.inOthers / kCell, t.inOthers / kCell));
            all.push_back(atMost(name + "in colliders, cells", a.inColliders / kCell, t.inColliders / kCell));
            all.push_back(atMost(name + "energy of no account, of what was put in", a.unnamed, .01));
            all.push_back(atMost(name + "energy that contact gives, of the most there was",
                                 std::max(0., a.fromContact) / a.mostEnergy, t.given));
            all.push_back(atLeast(name + "shortest step, frames of 1/480 s", a.shortest / kFrame, std::exp2(-16)));
            report(name, a, 0, all);
        }
    return all;
}

}  // namespace vdbfrac::lab::verify
