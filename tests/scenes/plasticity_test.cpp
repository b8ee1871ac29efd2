// Material that flows, against closed forms, and what it is to the rest of the program.
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/tetmesh/cell.h>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kE = 1e5, kNu = .3, kMu = kE / (2 * (1 + kNu));

std::string number(double value) { return std::to_string(value); }

/// A slab of which all nodes are held: those of its lower half still, those of its upper half move along `keys`. One
/// layer of cells between them is strained alike, over 1 m^2 and a voxel of .1 m.
struct Slab {
    std::string lattice = "six", keys, plasticity;
    int frames = 51;
    double fps = 50;

    std::string text() const
    {
        return "version = 1\n[time]\nframes = [1, " + std::to_string(frames) + "]\nfps = " + number(fps) +
               "\nsubsteps = 1\n[grid]\nvoxel_size = 0.1\nlattice = \"" + lattice +
               "\"\n[[body]]\nname = \"slab\"\nshape = { box = { size = [1, 0.3, 1], center = [0, 0.05, 0] } }\n"
               "material = \"m\"\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n"
               "[[grip]]\nname = \"low\"\nbody = \"slab\"\nmove = { velocity = [0, 0, 0] }\n"
               "region = { halfspace = { normal = [0, -1, 0], offset = -0.05 } }\n"
               "[[grip]]\nname = \"high\"\nbody = \"slab\"\nmove = { keys = [" +
               keys +
               "] }\nregion = { halfspace = { normal = [0, 1, 0], offset = 0.05 } }\n"
               "[solver]\nintegrator = \"static\"\n[plasticity]\n" +
               plasticity;
    }
};

/// What the stress of the upper grip on the slab is along x [Pa].
double shearStress(const core::StepRecord& step) { return step.gripLoad[1].x(); }

class FlowOn : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Lattices, FlowOn, testing::Values("six", "five"));

/// Von Mises: in shear it yields at s_y / sqrt(3), and the work beyond is dissipated.
TEST_P(FlowOn, YieldsAtTheVonMisesStress)
{
    constexpr double kYield = 1e3, kShear = .1, kSecondOrder = .01;  // Pa, of .1 m; of a shear strain of .1
    SceneRun run(Slab{.lattice = GetParam(),
                      .keys = "{ time = 0 }, { time = 1, translate = [0.01, 0, 0] }",
                      .plasticity = "yield_stress = 1e3\n"}
                     .text());
    run.toEnd();
    const double tau = kYield / std::sqrt(3.), elasticShear = tau / kMu;
    double dissipated = 0, unnamed = 0;
    for (const core::StepRecord& step : run.steps) {
        const double shear = kShear * step.time;
        EXPECT_NEAR(shearStress(step), std::min(kMu * shear, tau), kSecondOrder * tau) << step.time;
        const auto own = step.energyFlow.find("plasticity_dissipated");
        if (own != step.energyFlow.end()) {
            EXPECT_GE(own->second, -1e-9);
            dissipated += own->second;
        }
        unnamed += step.energyFlow.at("unnamed");
    }
    EXPECT_NEAR(run.steps.back().measured.at("plastic_strain_max"), (kShear - elasticShear) / std::sqrt(3.),
                kSecondOrder * kShear);
    const double expected = tau * (kShear - elasticShear) * .1;  // J in .1 m^3
    EXPECT_NEAR(dissipated, expected, kSecondOrder * expected);
    EXPECT_LT(std::abs(unnamed), kSecondOrder * expected);
}

/// Back to where it was, it is sheared the other way: stress follows the loop of a friction element.
TEST_P(FlowOn, ReversesWithItsElasticStiffness)
{
    constexpr double kSecondOrder = .01;
    SceneRun run(Slab{.lattice = GetParam(),
                      .keys = "{ time = 0 }, { time = 0.5, translate = [0.005, 0, 0] }, { time = 1 }",
                      .plasticity = "yield_stress = 1e3\n"}
                     .text());
    run.toEnd();
    const double tau = 1e3 / std::sqrt(3.);
    for (const core::StepRecord& step : run.steps) {
        const double shear = step.time < .5 ? .1 * step.time : .1 * (1 - step.time);
        const double expected = step.time < .5 ? std::min(kMu * shear, tau) : std::max(tau - kMu * (.05 - shear), -tau);
        EXPECT_NEAR(shearStress(step), expected, kSecondOrder * tau) << step.time;
    }
}

/// Held, what has no yield goes back to no shear by exp(-t / relaxation), with any step.
TEST_P(FlowOn, RelaxesByTheExponential)
{
    constexpr double kSecondOrder = 1e-3;
    for (const double fps : {10., 100.}) {
        SceneRun run(Slab{
            .lattice = GetParam(),
            .keys = "{ time = 0 }, { time = 0.1, translate = [0.001, 0, 0] }, { time = 9, translate = [0.001, 0, 0] }",
            .plasticity = "yield_stress = 0\nrelaxation = 0.5\n",
            .frames = int(fps) + 1,
            .fps = fps}
                         .text());
        run.toEnd();
        double first = 0, begin = 0;
        for (const core::StepRecord& step : run.steps) {
            if (step.time < .1 - 1e-9) continue;
            if (first == 0) first = shearStress(step), begin = step.time;
            EXPECT_NEAR(shearStress(step), first * std::exp(-(step.time - begin) / .5), kSecondOrder * first) << fps;
        }
        EXPECT_LT(run.steps.back().unnamedShare, .01);
    }
}

/// A bar, held by its ends, drawn and let go.
std::string bar(const std::string& lattice, double to, const std::string& plasticity, const std::string& more = "")
{
    return "version = 1\n[time]\nframes = [1, 61]\nfps = 50\nsubsteps = 1\n[grid]\nvoxel_size = 0.0625\nlattice = \"" +
           lattice +
           "\"\n[[body]]\nname = \"bar\"\nshape = { box = { size = [1.5, 0.25, 0.25] } }\nmaterial = \"m\"\n"
           "[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n"
           "[[grip]]\nname = \"left\"\nbody = \"bar\"\nmove = { velocity = [0, 0, 0] }\n"
           "region = { halfspace = { normal = [-1, 0, 0], offset = 0.74 } }\n"
           "[[grip]]\nname = \"right\"\nbody = \"bar\"\nuntil = 1\nmove = { velocity = [" +
           number(to) + ", 0, 0] }\nregion = { halfspace = { normal = [1, 0, 0], offset = 0.74 } }\n" + more +
           "[plasticity]\n" + plasticity;
}

/// Length over that at rest of the middle of the bar.
double middleStretch(const SceneRun& run)
{
    const core::Body& body = run.simulation.bodies()[0];
    double left = 0, right = 0, X = 0;
    int count = 0;
    for (std::size_t i = 0; i < body.mesh->nodeCount(); ++i) {
        const Vec3 at = body.mesh->restPosition(i);
        if (std::abs(std::abs(at.x()) - .1875) > 1e-6) continue;
        (at.x() < 0 ? left : right) += run.simulation.x()[i].x();
        X += std::abs(at.x()), ++count;
    }
    return (right - left) / X * (count > 0);
}

struct Drawn {
    double stress, plastic;  // Pa; p
};

/// s along a bar and its plastic stretch p, where it has a stretch of (1 + s / E) p: s = s_y + H a, and as its
/// stretches s1 = 1 + s / E and s2 = 1 - nu s / E go back with s1 s2^2 the same, da = (2 s1 + s2) / 3 d log p.
Drawn drawnTo(double stretch, double yield, double hardening)
{
    constexpr double kStep = 1e-6;
    double a = 0, log = 0;
    for (;; log += kStep) {
        const double strain = (yield + hardening * a) / kE;
        if ((1 + strain) * std::exp(log) >= stretch) return {kE * strain, std::exp(log)};
        a += (3 + (2 - kNu) * strain) / 3 * kStep;
    }
}

/// The pull is s / p of its section at rest, which is drawn thinner as it flows (its volume stays). What flows in a
/// step does so at its end: the pull is off by a part of the strain of a step, to first order.
TEST_P(FlowOn, AHardeningBarStaysAsLongAsItHasFlowed)
{
    constexpr double kWithin = .01;
    std::vector<double> errors;
    for (const int substeps : {1, 4}) {
        SceneRun run(
            bar(GetParam(), .45, "yield_stress = 2e3\nhardening = 2e4\n", "[solver]\nintegrator = \"static\"\n"),
            {"time.substeps=" + std::to_string(substeps)});
        run.toFrame(51);
        const double stretch = middleStretch(run), load = run.steps.back().gripLoad[1].x();
        const Drawn drawn = drawnTo(stretch, 2e3, 2e4);
        errors.push_back(load / (drawn.stress / drawn.plastic * .0625) - 1);
        EXPECT_GT(stretch, 1.2);
        run.toEnd();
        EXPECT_NEAR(middleStretch(run), drawn.plastic, kWithin * (drawn.plastic - 1));
        for (const core::StepRecord& step : run.steps) EXPECT_NE(step.outcome, core::Outcome::capped) << step.time;
        EXPECT_LT(run.steps.back().unnamedShare, .01);
    }
    EXPECT_LT(std::abs(errors[0]), kWithin);
    EXPECT_LT(std::abs(errors[1]), .4 * std::abs(errors[0]));
}

/// In motion, and slowly: no hardening.
TEST_P(FlowOn, ABarThatFlowsFreelyPullsWithItsYield)
{
    constexpr double kWithin = .02;
    SceneRun run(bar(GetParam(), .15, "yield_stress = 2e3\n", "[damping]\nstiffness = 0.01\nmass = 5\n"));
    run.toFrame(51);
    EXPECT_NEAR(run.steps.back().gripLoad[0].x(), -2e3 / (middleStretch(run) / 1.02) * .0625, kWithin * 125);
    const double stretch = middleStretch(run);
    run.toEnd();
    EXPECT_NEAR(middleStretch(run), stretch / 1.02, kWithin * stretch);
    for (const core::StepRecord& step : run.steps) {
        EXPECT_NE(step.outcome, core::Outcome::capped) << step.time;
        EXPECT_LT(step.unnamedShare, .01) << step.time;
    }
}

/// Of a body; the tets of a cell exchange some, so that they are under no pressure against each other.
TEST_P(FlowOn, VolumeNeverFlows)
{
    constexpr double kSecondOrder = 1e-4, kExchanged = .02;
    SceneRun run(bar(GetParam(), .45, "yield_stress = 2e3\nhardening = 2e4\n", "[solver]\nintegrator = \"static\"\n"));
    run.toFrame(51);
    solver::ElementSet set;
    const core::Body& body = run.simulation.bodies()[0];
    run.simulation.stages().flow[0]->describe(body, set);
    ASSERT_NE(set.inverseFlow, nullptr);
    double sum = 0, whole = 0;
    for (std::size_t e = 0; e < body.mesh->elements().size(); ++e)
        for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t) {
            const tetmesh::CellElement& element = body.mesh->elements()[e];
            const double V = tetmesh::cellTets(element.shape).volume[t] * element.fraction[t];
            if (!(V > 0)) continue;
            EXPECT_NEAR((*set.inverseFlow)(e, t).determinant(), 1, kExchanged);
            sum += V * (*set.inverseFlow)(e, t).determinant(), whole += V;
        }
    EXPECT_NEAR(sum / whole, 1, kSecondOrder);
}

TEST(Plasticity, WhatNeverYieldsLeavesTheStateAsIfItWereOmitted)
{
    const auto hash = [](const std::string& plasticity) {
        SceneRun run(bar("six", .2, "yield_stress = 1\n").substr(0, bar("six", .2, "").find("[plasticity]")) +
                     "[gravity]\n[fracture]\ntoughness = 30\n" + plasticity);
        run.toFrame(20);
        return run.simulation.stateHash();
    };
    const std::uint64_t bare = hash("");
    EXPECT_EQ(hash("[plasticity]\nyield_stress = 1e300\n"), bare);
    EXPECT_NE(hash("[plasticity]\nyield_stress = 1e3\n"), bare);
}

std::string tearing(const std::string& lattice)
{
    return bar(lattice, .9, "yield_stress = 3e3\nhardening = 1e4\nfracture_share = 0.5\n",
               "[damping]\nstiffness = 0.002\n[fracture]\nkappa = 300\n");
}

class TornBar : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Lattices, TornBar, testing::Values("six", "five", "delaunay"));

/// Threads, checkpoints, cuts: what has flowed goes along to the bit.
TEST_P(TornBar, GoesOnToTheSameBits)
{
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        SceneRun run(tearing(GetParam()));
        run.toEnd();
        return run.simulation.stateHash();
    };
    SceneRun whole(tearing(GetParam()));
    while (whole.work.countOf("cut", "cells") == 0) {
        ASSERT_FALSE(whole.atEnd());
        whole.step();
    }
    core::Archive archive;
    whole.simulation.save(archive);
    SceneRun resumed(tearing(GetParam()));
    resumed.simulation.restoreFrom(archive);
    while (!whole.atEnd()) {
        const core::StepRecord &a = whole.step(), &b = resumed.step();
        EXPECT_EQ(a.elasticEnergy, b.elasticEnergy);
        EXPECT_EQ(whole.simulation.stateHash(), resumed.simulation.stateHash()) << a.time;
        EXPECT_LT(a.unnamedShare, .01) << a.time;
    }
    for (const int threads : {1, 3}) EXPECT_EQ(run(threads), whole.simulation.stateHash()) << threads;
}

/// Tets of a lattice twice as fine lie in one of the wide lattice each: what is sheared alike has the energy it had.
TEST_P(FlowOn, GoesAlongToAFinerLattice)
{
    constexpr double kRounding = 1e-6;  // of points as they are carried to the finer lattice
    const std::string scene = Slab{.lattice = GetParam(),
                                   .keys = "{ time = 0 }, { time = 1, translate = [0.01, 0, 0] }",
                                   .plasticity = "yield_stress = 1e3\nhardening = 1e3\n"}
                                  .text();
    SceneRun wide(scene), fine(scene, {"grid.voxel_size=0.05"});
    wide.toFrame(26);
    EXPECT_GT(wide.steps.back().measured.at("plastic_strain_max"), .01);
    core::Archive archive;
    wide.simulation.save(archive);
    fine.simulation.refineFrom(wide.simulation, archive);
    const double energy = wide.simulation.totals().elasticEnergy;
    EXPECT_NEAR(fine.simulation.totals().elasticEnergy, energy, kRounding * energy);
}

/// Bodies of a material of its own flow by that.
TEST_P(FlowOn, GoesByTheMaterial)
{
    constexpr double kSecondOrder = .02;
    SceneRun run(Slab{.lattice = GetParam(),
                      .keys = "{ time = 0 }, { time = 1, translate = [0.01, 0, 0] }",
                      .plasticity = "yield_stress = 1e3\n[[plasticity.material]]\nname = \"m\"\nyield_stress = 2e3\n"}
                     .text());
    run.toEnd();
    EXPECT_NEAR(shearStress(run.steps.back()), 2e3 / std::sqrt(3.), kSecondOrder * 2e3);
}

TEST_P(FlowOn, EndsAtTheLargestStretch)
{
    constexpr double kStep = .01, kMost = 1.1;  // of stretch a step; of what flows
    SceneRun run(bar(GetParam(), .45, "yield_stress = 2e3\nhardening = 1e4\nmax_stretch = 1.1\n",
                     "[solver]\nintegrator = \"static\"\n"));
    run.toFrame(51);
    EXPECT_GT(middleStretch(run), 1.25);
    EXPECT_GT(run.steps.back().gripLoad[1].x(), 3 * .0625 * 2e3);  // it is elastic again
    run.toEnd();
    EXPECT_NEAR(middleStretch(run), kMost, kStep);
}

/// The bulk energy is of tr e: what goes back with its volume over a long way is under pressure then.
TEST_P(FlowOn, GivesNoEnergyInLongSteps)
{
    for (const double far : {.05, .3, .6}) {  // m, of 1.5 m, in one step
        SceneRun run(bar(GetParam(), far, "yield_stress = 10\n", "[solver]\nintegrator = \"static\"\n"),
                     {"time.fps=1", "time.frames=[1, 2]"});
        EXPECT_GT(run.step().energyFlow.at("plasticity_dissipated"), 0) << far;
    }
}

/// Work that was done on it makes it weaker, but what nothing pulls at does not tear.
TEST_P(FlowOn, WhatIsLetGoTearsNoFurther)
{
    SceneRun run(bar(GetParam(), .9, "yield_stress = 3e3\nhardening = 1e4\nfracture_share = 0.5\n",
                     "[damping]\nstiffness = 0.02\nmass = 5\n[fracture]\nkappa = 600\n"));
    run.toFrame(52);
    EXPECT_GT(run.work.countOf("cut", "cells"), 0);
    EXPECT_GE(run.simulation.fragments(), 2u);
    const double volume = run.simulation.volume();
    run.toEnd();
    EXPECT_EQ(run.simulation.volume(), volume);
}

/// Elastic energy grows no more where material flows: what tears it is the work of the pull, at the plastic strain a
/// where w + fracture_share W is kappa, W = (yield_stress + hardening a / 2) a, of the mean over three cells round a
/// neck.
TEST(Plasticity, WorkOfTheFlowTearsWhatItsElasticEnergyNeverWould)
{
    constexpr double kYield = 3e3, kHardening = 2e3, kKappa = 1000, kE = 1e5;  // Pa, Pa, J/m^3, Pa
    constexpr double kPeak = 1.3, kNear = .05;  // of the mean, in the tet that has flowed most; from share to share
    const auto drivingOverKappa = [](double share) {
        SceneRun run(bar("six", .9, "yield_stress = 3e3\nhardening = 2e3\nfracture_share = " + number(share) + "\n",
                         "[damping]\nstiffness = 0.002\n[fracture]\nkappa = 1000\n"));
        while (run.simulation.framesDone() < 50) {
            const core::StepRecord& step = run.step();
            if (step.work.countOf("cut", "cells") == 0) continue;
            const double a = step.measured.at("plastic_strain_max"), stress = kYield + kHardening * a;
            return (stress * stress / (2 * kE) + share * (kYield + kHardening * a / 2) * a) / kKappa;
        }
        return 0.;  // it never tears
    };
    EXPECT_EQ(drivingOverKappa(0), 0);
    for (const double share : {.4, .5, .7}) EXPECT_NEAR(drivingOverKappa(share), kPeak, kNear) << share;
}

/// Stress beyond a small yield counts by what it works, not by how far it is beyond.
TEST(Plasticity, CreepTearsByItsWorkAlone)
{
    for (const std::string yield : {"1", "100", "1000"}) {
        SceneRun run(bar("six", .15, "yield_stress = " + yield + "\nrelaxation = 0.5\nfracture_share = 0.1\n",
                         "[damping]\nstiffness = 0.002\n[fracture]\nkappa = 2000\n"));
        run.toFrame(51);
        EXPECT_EQ(run.work.countOf("cut", "cells"), 0) << yield;
    }
}

TEST(Plasticity, SaysWhereItDoesNotGo)
{
    const auto message = [](const std::string& solver, const std::string& plasticity = "yield_stress = 1e3\n") {
        try {
            SceneRun run(bar("six", .1, plasticity, "[solver]\n" + solver));
        } catch (const InputError& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_NE(message("integrator = \"midpoint\"\n").find("midpoint"), std::string::npos);
    EXPECT_NE(message("strain = \"green\"\n").find("green"), std::string::npos);
    EXPECT_NE(message("", "yield_stress = 0\n").find("relaxation"), std::string::npos);
}

}  // namespace
