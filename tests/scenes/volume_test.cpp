// What keeps the volume of squeezed material, against its energy and closed forms.
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <vdbfrac/solver/element.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kE = 1e4, kLeast = 0.8, kStiffness = 10;  // Pa, 1, 1

const std::string kVolume = "[volume]\nleast = 0.8\nstiffness = 10\n";

std::string block(const std::string& lattice, const std::string& more)
{
    return "version = 1\n[time]\nframes = [1, 3]\n[grid]\nvoxel_size = 0.1\nlattice = \"" + lattice +
           "\"\n[[body]]\nname = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [0.4, 0.3, 0.2] } }\n"
           "[material.gel]\nyoungs_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n" +
           more;
}

/// The potential of [volume] alone, on a block.
class BlockVolume {
public:
    explicit BlockVolume(const std::string& lattice)
        : run_(block(lattice, kVolume)), effects_(effects::makeEffects(run_.scene))
    {
        potential = dynamic_cast<solver::Potential*>(effects_.back().get());
        rest = std::vector<Vec3>(run_.simulation.x().begin(), run_.simulation.x().end());
        potential->begin({rest, rest, 1, run_.simulation.elastic()});
    }
    std::vector<Vec3> moved(const Mat3& A, double noise, unsigned seed) const
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> of(-noise, noise);
        std::vector<Vec3> x;
        for (const Vec3& X : rest) x.push_back(A * X + Vec3(of(random), of(random), of(random)));
        return x;
    }
    double energy(std::span<const Vec3> x) const
    {
        std::vector<Vec3> unused(x.size(), Vec3::Zero());
        return potential->evaluate(x, unused);
    }
    std::vector<Vec3> gradient(std::span<const Vec3> x) const
    {
        std::vector<Vec3> g(x.size(), Vec3::Zero());
        potential->evaluate(x, g);
        return g;
    }
    /// u.H u of what it gives to the tangent.
    double curvature(std::span<const Vec3> x, std::span<const Vec3> u) const
    {
        std::vector<solver::ScalarCoupling> couplings;
        potential->linearizeScalars(x, run_.simulation.elastic(), couplings);
        double sum = 0;
        for (const solver::ScalarCoupling& c : couplings) {
            double change = 0;
            for (std::size_t a = 0; a < c.node.size(); ++a) change += c.gradient[a].cast<double>().dot(u[c.node[a]]);
            sum += change * change;
        }
        return sum;
    }

    double volume() const
    {
        double mass = 0;
        for (double m : run_.simulation.elastic().mass()) mass += m;
        return mass / 1000;
    }

    solver::Potential* potential;
    std::vector<Vec3> rest;

private:
    SceneRun run_;
    std::vector<std::unique_ptr<core::Effect>> effects_;
};

const Mat3 kU = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
const Mat3 kV = Eigen::AngleAxisd(-1.1, Vec3(2, -1, 1).normalized()).toRotationMatrix();

Mat3 turned(const Vec3& stretches) { return kU * stretches.asDiagonal() * kV.transpose(); }

const Vec3 kStretches[] = {{0.9, 0.9, 0.9},  {1.4, 1.3, 0.2}, {0.8, 0.6, 0.5},
                           {1.2, 0.9, -0.1}, {0.3, 0.2, 0.1}, {1, 1, -1}};

class VolumeOn : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Lattices, VolumeOn, testing::Values("six", "five", "delaunay"));

TEST_P(VolumeOn, AffineMotionHasItsEnergy)
{
    const BlockVolume block(GetParam());
    for (const Vec3& s : kStretches) {
        const double missing = std::max(0., kLeast - s.prod());
        EXPECT_NEAR(block.energy(block.moved(turned(s), 0, 1)),
                    block.volume() * kStiffness * kE / 2 * missing * missing, 1e-10 * block.volume() * kE);
    }
    EXPECT_EQ(block.energy(block.moved(turned({1.6, 1, 0.51}), 0, 1)), 0);
}

TEST_P(VolumeOn, GradientIsThatOfItsEnergy)
{
    const BlockVolume block(GetParam());
    constexpr double kStep = 1e-6;  // m
    unsigned seed = 1;
    for (const Vec3& s : kStretches) {
        const std::vector<Vec3> x = block.moved(turned(s), 0.005, ++seed), g = block.gradient(x);
        for (int way = 0; way < 8; ++way) {
            std::vector<Vec3> u = block.moved(Mat3::Zero(), 1, ++seed), ahead = x, behind = x;
            double slope = 0, size = 0;
            for (std::size_t n = 0; n < x.size(); ++n) {
                ahead[n] += kStep * u[n], behind[n] -= kStep * u[n];
                slope += g[n].dot(u[n]), size += g[n].norm() * u[n].norm();
            }
            EXPECT_NEAR((block.energy(ahead) - block.energy(behind)) / (2 * kStep), slope, 1e-7 * size);
        }
    }
}

/// f'' (dJ)^2; f' d2J, which is left out, is 6 f' s in a change of all lengths, and 0 along one of them.
TEST_P(VolumeOn, TangentIsThatOfTheSquareOfWhatIsMissing)
{
    const BlockVolume block(GetParam());
    const auto curvature = [&](const Vec3& s, const Mat3& between) {
        constexpr double kStep = 1e-5;
        const Mat3 dF = kU * between * kV.transpose();
        const std::vector<Vec3> u = block.moved(dF, 0, 1);
        const std::vector<Vec3> ahead = block.gradient(block.moved(turned(s) + kStep * dF, 0, 1)),
                                behind = block.gradient(block.moved(turned(s) - kStep * dF, 0, 1));
        double sum = 0;
        for (std::size_t n = 0; n < u.size(); ++n) sum += (ahead[n] - behind[n]).dot(u[n]) / (2 * kStep);
        return std::pair(block.curvature(block.moved(turned(s), 0, 1), u), sum);
    };
    constexpr double kRounding = 1e-5;  // of floats
    for (const Vec3& s : {Vec3(1.3, 1.2, 0.05), Vec3(0.9, 0.8, 0.7), Vec3(1, 1, -0.5)}) {
        const auto [kept, true_] = curvature(s, Vec3(0, 0, 1).asDiagonal());
        EXPECT_NEAR(kept / true_, 1, kRounding);
    }
    const double s = 0.8, missing = kLeast - s * s * s, k = block.volume() * kStiffness * kE;
    const auto [kept, true_] = curvature({s, s, s}, Mat3::Identity());
    EXPECT_NEAR(kept / k, 9 * std::pow(s, 4), kRounding);
    EXPECT_NEAR((kept - true_) / k, 6 * missing * s, kRounding);
}

/// A soft ball that hits the floor faster than waves run in it.
std::string drop(const std::string& more)
{
    return "version = 1\n[time]\nframes = [1, 5]\nfps = 24\n[grid]\nvoxel_size = 0.05\n"
           "[[body]]\nname = \"ball\"\nmaterial = \"jelly\"\nvelocity = [0, -4, 0]\n"
           "shape = { sphere = { radius = 0.2, center = [0, 0.21, 0] } }\n"
           "[material.jelly]\nyoungs_modulus = 8000\npoisson_ratio = 0.45\ndensity = 1000\n"
           "[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\n" +
           more;
}

double volumeShare(const core::Simulation& simulation)
{
    double now = 0, rest = 0;
    for (const solver::ElementSet& set : simulation.elastic().sets())
        for (const tetmesh::CellElement& e : set.elements) {
            const tetmesh::CellTets& tets = tetmesh::cellTets(e.shape);
            for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
                const double V = tets.volume[t] * e.fraction[t];
                rest += V;
                if (V > 0)
                    now += V * solver::deformationGradient({e, nullptr, simulation.elastic().h()}, t,
                                                           simulation.x().subspan(set.firstNode))
                                   .determinant();
            }
        }
    return now / rest;
}

TEST(Volume, KeepsABallThatHitsFasterThanWavesRun)
{
    const auto least = [](SceneRun& run) {
        double share = 1;
        while (run.simulation.framesDone() < 4) {
            run.step();
            share = std::min(share, volumeShare(run.simulation));
        }
        return share;
    };
    SceneRun crushed(drop("")), kept(drop("[volume]\n"));
    EXPECT_LT(least(crushed), 0.4);
    EXPECT_GT(least(kept), 0.75);
    double work = 0, most = 0;
    for (const core::StepRecord& step : kept.steps) {
        EXPECT_LT(step.unnamedShare, 1e-3);
        work += step.energyFlow.at("volume_work"), most = std::min(most, work);
    }
    EXPECT_GT(kept.work.countOf("volume", "squeezed"), 0);
    // What it takes it holds, and gives back.
    EXPECT_LT(most, -1);
    EXPECT_GT(work, most);
}

/// Their step limit asks before a step begins, and after a cut.
TEST(Volume, HoldsWithExplicitSchemesThroughCuts)
{
    for (const std::string integrator : {"symplectic_euler", "forward_euler"}) {
        SceneRun run(drop("[volume]\n[damping]\nmass = 1\n[fracture]\ntoughness = 1\n[solver]\nintegrator = \"" +
                          integrator + "\"\n"));
        run.toFrame(2);
        EXPECT_GT(run.work.countOf("volume", "squeezed"), 0);
        EXPECT_GT(run.work.countOf("cut", "cells"), 0);
        EXPECT_TRUE(std::isfinite(run.steps.back().kineticEnergy));
        EXPECT_GT(volumeShare(run.simulation), 0.6);
    }
}

/// What a cut leaves of an element has another mean deformation. Before it was allowed what it lacks then, tears in
/// squeezed material gave energy.
TEST(Volume, GivesNoEnergyWhereMaterialTears)
{
    constexpr double kRounding = 1e-9;  // of what grips put in
    for (const std::string lattice : {"six", "five", "delaunay"}) {
        SceneRun run("version = 1\n[time]\nframes = [1, 12]\n[grid]\nvoxel_size = 0.05\nlattice = \"" + lattice +
                     "\"\n[[body]]\nname = \"strip\"\nmaterial = \"gel\"\n"
                     "shape = { box = { size = [0.68, 0.68, 0.28] } }\n"
                     "cut = [{ box = { size = [0.4, 0.06, 1], center = [-0.34, 0, 0] } }]\n"
                     "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.45\ndensity = 1000\n"
                     "[[grip]]\nname = \"top\"\nbody = \"strip\"\nmove = { velocity = [0, 0.4, 0] }\n"
                     "region = { halfspace = { normal = [0, 1, 0], offset = 0.3 } }\n"
                     "[[grip]]\nname = \"bottom\"\nbody = \"strip\"\nmove = { velocity = [0, -0.4, 0] }\n"
                     "region = { halfspace = { normal = [0, -1, 0], offset = 0.3 } }\n"
                     "[fracture]\ntoughness = 100\n[volume]\nleast = 1\nstiffness = 50\n");
        double work = 0, in = 0, most = 0;
        while (!run.atEnd()) {
            for (const auto& [name, joules] : run.step().energyFlow) {
                if (name == "volume_work") work += joules, most = std::max(most, work);
                if (name == "work_top" || name == "work_bottom") in += joules;
            }
        }
        EXPECT_GT(run.work.countOf("cut", "cells"), 0) << lattice;
        EXPECT_LT(work, 0) << lattice;  // that of material that is gone
        EXPECT_LT(most, kRounding * in) << lattice;
    }
}

/// A body that is gone has no nodes, and shares the number of its first with the body after it.
TEST(Volume, IsThatOfEachBodyWhereAnotherIsGone)
{
    const std::string scene =
        "version = 1\n[time]\nframes = [1, 6]\nfps = 24\nsubsteps = 4\n[grid]\nvoxel_size = 0.05\n"
        "[[body]]\nname = \"crumb\"\nmaterial = \"weak\"\nangular_velocity = [0, 0, 150]\n"
        "shape = { box = { size = [0.16, 0.11, 0.11], center = [-1, 0, 0] } }\n"
        "[[body]]\nname = \"ball\"\nmaterial = \"jelly\"\nvelocity = [0, -4, 0]\n"
        "shape = { sphere = { radius = 0.2, center = [0, 0.21, 0] } }\n"
        "[material.weak]\nyoungs_modulus = 2000\npoisson_ratio = 0.3\ndensity = 1000\n"
        "[material.jelly]\nyoungs_modulus = 8000\npoisson_ratio = 0.45\ndensity = 1000\n"
        "[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\n"
        "[fracture]\ntoughness = 0.0005\n[volume]\n";
    SceneRun whole(scene);
    while (whole.simulation.bodies()[0].mesh->nodeCount() > 0) {
        ASSERT_FALSE(whole.atEnd());
        whole.step();
    }
    for (int i = 0; i < 4; ++i) whole.step();
    core::Archive archive;
    whole.simulation.save(archive);
    SceneRun resumed(scene);
    resumed.simulation.restoreFrom(archive);
    ASSERT_FALSE(whole.atEnd());
    while (!whole.atEnd()) {
        whole.step(), resumed.step();
        EXPECT_EQ(whole.simulation.stateHash(), resumed.simulation.stateHash());
    }
}

TEST(Volume, DoesNothingToWhatKeepsItsVolume)
{
    const std::string swing = block("six",
                                    "[gravity]\n[[grip]]\nbody = \"block\"\nregion = { halfspace = { normal = "
                                    "\"x\", offset = -0.1 } }\nmove = { velocity = [0, 0, 0] }\n");
    SceneRun without(swing), with(swing + "[volume]\n");
    without.toEnd(), with.toEnd();
    EXPECT_EQ(with.simulation.stateHash(), without.simulation.stateHash());
    EXPECT_EQ(with.work.countOf("volume", "squeezed"), 0);
    // It looks all the same, and the table of work tells what that takes.
    EXPECT_GE(with.work.countOf("volume", "calls"), with.work.countOf("solve", "newton_iterations"));
    EXPECT_EQ(without.work.countOf("volume", "calls"), 0);
}

}  // namespace
