// How bodies move, and how long the steps are in which they do: against closed forms.
#include <vdbfrac/base/error.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/samples/axial_bar.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/scenes/saw.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/solver/integrator.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kRounding = 1e-12;  // relative: of sums over some thousand nodes

/// A box off the origin. `body` has more keys of it, `more` more tables.
std::string box(const std::string& body, const std::string& more)
{
    return "version = 1\nname = \"box\"\n[time]\nframes = [1, 100]\nfps = 100\nsubsteps = 1\n[grid]\nvoxel_size = "
           "0.1\n[solver]\n"
           "newton_tolerance = 1e-9\nlinear_tolerance = 1e-6\n[[body]]\nname = \"box\"\nmaterial = \"m\"\n"
           "shape = { box = { size = [1.1, 0.5, 0.7], center = [2, -1, 3] } }\n" +
           body + "\n[material.m]\nyoungs_modulus = 1e3\npoisson_ratio = 0.3\ndensity = 1000\n" + more;
}
const Vec3 kCenter(2, -1, 3);

const std::string kFlight = "velocity = [1, 2, -1]\nangular_velocity = [0.5, -0.2, 0.4]\n";
Vec3 flightAt(const Vec3& X) { return Vec3(1, 2, -1) + Vec3(0.5, -0.2, 0.4).cross(X - kCenter); }

TEST(Body, SetsOffWithItsVelocityAndSpinsAboutItsCenter)
{
    const SceneRun run(box(kFlight, ""));
    const core::Simulation& simulation = run.simulation;
    const auto X = tetmesh::restPositions(*simulation.bodies()[0].mesh);
    const auto mass = simulation.elastic().mass();
    Vec3 momentum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < X.size(); ++i) {
        // The box is its own mirror image at its center.
        EXPECT_LT((simulation.v()[i] - flightAt(X[i])).norm(), kRounding * 10);
        momentum += mass[i] * simulation.v()[i];
        total += mass[i];
    }
    EXPECT_LT((momentum - total * Vec3(1, 2, -1)).norm(), kRounding * total * 10);
}

/// The mass of a body is its density times the volume of its shape, at 8 cells across and on every lattice.
TEST(Body, HasTheMassOfItsShape)
{
    constexpr double kAtEightCells = 5e-3, kDensity = 1000;
    const double pi = std::numbers::pi;
    struct Shape {
        std::string text;
        double volume;
    };
    const std::vector<Shape> shapes{
        {"{ box = { size = [1, 1, 1] } }", 1},
        {"{ box = { size = [1, 1, 1], center = [0.03, 0.11, 0.07] } }", 1},
        {"{ box = { size = [1.5, 1, 0.5] } }", .75},
        {"{ sphere = { radius = 0.5, center = [0.02, 0.05, 0.1] } }", pi / 6},
        {"{ cylinder = { axis = \"y\", radius = 0.5, height = 1 } }", pi / 4},
    };
    const std::vector<std::string> grids{"voxel_size = 0.125", "voxel_size = 0.125\nlattice = \"five\"",
                                         "voxel_size = 0.0625\ncoarsening = 2",
                                         "voxel_size = 0.125\nlattice = \"delaunay\""};
    for (const Shape& shape : shapes)
        for (const std::string& grid : grids) {
            const SceneRun run("version = 1\nname = \"mass\"\n[time]\nframes = [1, 2]\n[grid]\n" + grid +
                               "\n[[body]]\nname = \"body\"\nmaterial = \"m\"\nshape = " + shape.text +
                               "\n[material.m]\nyoungs_modulus = 1e3\npoisson_ratio = 0.3\ndensity = 1000\n");
            double mass = 0;
            for (double m : run.simulation.elastic().mass()) mass += m;
            EXPECT_NEAR(mass / kDensity / shape.volume, 1, kAtEightCells) << shape.text << ' ' << grid;
            EXPECT_EQ(run.simulation.fragments(), 1u) << shape.text << ' ' << grid;
        }
}

/// What is left of a body that is cut in flight goes on as it flew: momentum and energy are lost only with the mass of
/// the kerf.
TEST(Cut, LeavesEachPieceItsMomentumAndKineticEnergy)
{
    constexpr double kStep = 1e-6;      // s, so short that the spin strains nothing
    constexpr double kStrain = 1e-5;    // m/s: what the step and its tolerance may change of velocities
    constexpr double kHalfKerf = 0.04;  // m, of less than a cell: the nodes in its plane get copies
    lab::Saw saw(kCenter.x(), kHalfKerf);
    SceneRun run(box(kFlight, ""), {"time.fps=1e6"}, &saw);
    const std::size_t nodes = run.simulation.x().size();
    const double start = run.simulation.volume();
    const core::StepRecord& step = run.step();
    const core::Simulation& simulation = run.simulation;
    ASSERT_EQ(simulation.fragments(), 2u);
    EXPECT_NEAR(start - simulation.volume(), 2 * kHalfKerf * 0.5 * 0.7, 0.1 * start);
    EXPECT_GE(simulation.x().size(), nodes + 5 * 7);
    const auto X = tetmesh::restPositions(*simulation.bodies()[0].mesh);
    const auto mass = simulation.elastic().mass();
    Vec3 momentum[2] = {Vec3::Zero(), Vec3::Zero()}, expected[2] = {Vec3::Zero(), Vec3::Zero()};
    double energy = 0, total = 0;
    for (std::size_t i = 0; i < X.size(); ++i) {
        const std::uint32_t piece = simulation.bodies()[0].fragments.ofNode()[i];
        ASSERT_LT(piece, 2u);
        const Vec3 v = flightAt(X[i]);
        EXPECT_LT((simulation.v()[i] - v).norm(), kStrain);
        EXPECT_LT((simulation.x()[i] - X[i] - kStep * v).norm(), kStrain * kStep);
        momentum[piece] += mass[i] * simulation.v()[i];
        expected[piece] += mass[i] * v;
        energy += 0.5 * mass[i] * v.squaredNorm();
        total += mass[i];
    }
    EXPECT_NEAR(total, 1000 * simulation.volume(), kRounding * total);
    for (int piece : {0, 1}) EXPECT_LT((momentum[piece] - expected[piece]).norm(), kStrain * total);
    EXPECT_NEAR(step.kineticEnergy, energy, kStrain * total * 3);
}

/// Free flight against damping.mass = a: what each scheme makes of v' = -a v.
TEST(Damping, OfTheMassSlowsFreeFlightAsEachIntegratorSolvesIt)
{
    constexpr double a = 30, dt = 0.01, kSolved = 1e-8;
    constexpr int kSteps = 4;
    constexpr double gamma = 1 - std::numbers::sqrt2 / 2, one = 1 / (1 + gamma * a * dt);
    const std::pair<const char*, double> schemes[] = {
        {"backward_euler", 1 / (1 + a * dt)},
        {"midpoint", (1 - a * dt / 2) / (1 + a * dt / 2)},
        {"sdirk2", one * (1 + (1 - gamma) / gamma * (one - 1))},
        {"symplectic_euler", 1 - a * dt},
        {"forward_euler", 1 - a * dt},
    };
    for (const auto& [scheme, factor] : schemes) {
        SceneRun run(box("velocity = [1, 2, -1]\n", "[damping]\nmass = 30\n"),
                     {std::string("solver.integrator=\"") + scheme + '"'});
        for (int n = 0; n < kSteps; ++n) run.step();
        const Vec3 expected = std::pow(factor, kSteps) * Vec3(1, 2, -1);
        for (const Vec3& v : run.simulation.v()) EXPECT_LT((v - expected).norm(), kSolved * expected.norm()) << scheme;
    }
}

/// However small the turn of a step: of stiff and small bodies little of it would be much strain.
TEST(Damping, OfTheStiffnessLeavesASpinAlone)
{
    constexpr double kWithin = 0.02;  // of the kinetic energy
    constexpr int kSteps = 30;
    for (const char* scheme : {"backward_euler", "midpoint", "sdirk2"})
        for (const double rate : {.2, 1., 2.5, 4., 10.}) {  // 1/s: .002 to .1 radians a step
            const auto left = [&](const char* damping) {
                const std::string spin = "angular_velocity = [0, 0, " + std::to_string(rate) + "]\n";
                SceneRun run(box(spin, damping),
                             {std::string("solver.integrator=\"") + scheme + '"', "material.m.youngs_modulus=1e6"});
                for (int n = 1; n < kSteps; ++n) run.step();
                return run.step().kineticEnergy;
            };
            const double alone = left("");
            EXPECT_NEAR(left("[damping]\nstiffness = 0.005\n"), alone, kWithin * alone) << scheme << ", " << rate;
        }
}

/// The potentials of a [damping] table, for a solver without a scene's bodies.
class DampingAlone {
public:
    explicit DampingAlone(const std::string& keys)
        : scene_(scene::parseScene(box("", "[damping]\n" + keys + "\n"), "test.toml", effects::vocabulary())),
          effects_(effects::makeEffects(scene_))
    {
        for (const auto& effect : effects_) effect->join(stages_);
    }
    std::span<solver::Potential* const> potentials() const { return stages_.solve; }

private:
    scene::Scene scene_;
    std::vector<std::unique_ptr<core::Effect>> effects_;
    core::Stages stages_;
};

/// A mode of the circular frequency w has the damping ratio mass/(2w) + stiffness w/2 (docs/scene.md). The midpoint
/// rule adds none.
TEST(Damping, OfAModeIsHalfOfMassOverItsFrequencyAndOfStiffnessTimesIt)
{
    constexpr double kRatio = 0.1;
    constexpr double kAllowed = 0.02;  // of the amplitude: on 16 cells the square of the frequency is off by 1 %
    constexpr int kSteps = 200;
    for (const bool ofMass : {true, false}) {
        lab::AxialBar bar;
        const double w = 2 * std::numbers::pi / bar.period, period = bar.period / std::sqrt(1 - kRatio * kRatio);
        const DampingAlone damping(ofMass ? "mass = " + std::to_string(2 * kRatio * w)
                                          : "stiffness = " + std::to_string(2 * kRatio / w));
        const solver::StepLoads loads{damping.potentials(),
                                      [&](double) -> const solver::Boundary& { return bar.boundary; }};
        const auto midpoint = solver::makeIntegrator(solver::Scheme::midpoint, bar.elastic, lab::tightSettings());
        const double start = bar.tip();
        for (int n = 0; n < kSteps; ++n)
            EXPECT_EQ(midpoint->step(bar.state, period / kSteps, loads).status, solver::StepStatus::converged);
        const double expected = std::exp(-2 * std::numbers::pi * kRatio / std::sqrt(1 - kRatio * kRatio));
        std::printf("damped by %s: %.4f of the amplitude after a period, theory %.4f\n", ofMass ? "mass" : "stiffness",
                    bar.tip() / start, expected);
        EXPECT_NEAR(bar.tip() / start, expected, kAllowed * expected);
    }
}

TEST(Grips, KeysTurnAboutXThenYThenZ)
{
    struct Turn {
        const char* degrees;
        Vec3 (*turned)(const Vec3&);
    };
    const Turn turns[] = {{"[90, 0, 90]", [](const Vec3& p) { return Vec3(p.z(), p.x(), p.y()); }},
                          {"[90, 90, 0]", [](const Vec3& p) { return Vec3(p.y(), -p.z(), -p.x()); }},
                          {"[0, 90, 90]", [](const Vec3& p) { return Vec3(-p.y(), p.z(), -p.x()); }}};
    const Vec3 pivot(2.1, -1.2, 3.3), shift(0.1, 0.2, 0.4);
    for (const Turn& turn : turns) {
        SceneRun run(box(
            "", std::string(
                    "[[grip]]\nbody = \"box\"\nregion.sphere.radius = 9\nmove = { pivot = [2.1, -1.2, 3.3], keys = ["
                    "{ time = 0 }, { time = 0.01, translate = [0.1, 0.2, 0.4], rotate = ") +
                    turn.degrees + " }] }\n"));
        run.step();
        const auto X = tetmesh::restPositions(*run.simulation.bodies()[0].mesh);
        for (std::size_t i = 0; i < X.size(); ++i)
            EXPECT_LT((run.simulation.x()[i] - (pivot + turn.turned(X[i] - pivot) + shift)).norm(), kRounding)
                << turn.degrees;
    }
}

/// Loads add up to what holds the box, in grips that share nodes too.
TEST(Grips, EachTellsItsOwnLoad)
{
    const auto grip = [](const char* move) {
        return std::string("[[grip]]\nbody = \"box\"\nregion.sphere.radius = 9\nmove = { ") + move + " }\n";
    };
    SceneRun pulled(box("", grip("force = [0, 100, 0]") + grip("force = [20, 50, 0]")));
    const std::vector<Vec3> forces = pulled.step().gripLoad;
    EXPECT_LT((forces[0] - Vec3(0, 100, 0)).norm(), 1e-9);
    EXPECT_LT((forces[1] - Vec3(20, 50, 0)).norm(), 1e-9);

    const std::string up = "velocity = [0, 1, 0]", weight = "[gravity]\nacceleration = [0, -10, 0]\n";
    SceneRun one(box("", grip(up.c_str()) + weight)), two(box("", grip(up.c_str()) + grip(up.c_str()) + weight));
    const Vec3 alone = one.step().gripLoad[0];
    const std::vector<Vec3> both = two.step().gripLoad;
    EXPECT_GT(alone.norm(), 1);
    EXPECT_LT((both[0] + both[1] - alone).norm(), 1e-9 * alone.norm());
}

/// A grip that lets go leaves what it held its momentum, which stays from then on. A step ends when it does.
TEST(Grips, LetGoWhenTheirTimeHasCome)
{
    constexpr double kUntil = .0435;  // s, within a frame
    SceneRun run(box("",
                     "[[grip]]\nname = \"hand\"\nbody = \"box\"\nregion = { halfspace = { normal = [-1, 0, 0], "
                     "offset = -1.7 } }\nmove = { velocity = [1, 2, 0] }\nuntil = " +
                         std::to_string(kUntil) + "\n"));
    const core::Simulation& simulation = run.simulation;
    const auto momentum = [&] {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < simulation.v().size(); ++i)
            sum += simulation.elastic().mass()[i] * simulation.v()[i];
        return sum;
    };
    const std::size_t held = simulation.gripNodes(0).size();
    ASSERT_GT(held, 0u);
    while (simulation.time() < kUntil - 1e-9) EXPECT_GT(run.step().gripLoad[0].norm(), 1e-3);
    EXPECT_NEAR(simulation.time(), kUntil, 1e-12);
    EXPECT_EQ(simulation.gripNodes(0).size(), 0u);
    const Vec3 before = momentum();
    EXPECT_GT(before.norm(), 1);
    run.toFrame(8);
    EXPECT_EQ(run.steps.back().gripLoad[0], Vec3(0, 0, 0));
    EXPECT_LT((momentum() - before).norm(), 1e-6 * before.norm());  // the tolerance of the solves
    for (const core::StepRecord& s : run.steps) EXPECT_LT(s.unnamedShare, core::kMaxUnnamedShare) << s.time;
}

/// Times in scenes are rounded: a grip lets go with the frame that it means, in no step of its own.
TEST(Grips, LetGoWithTheFrameThatTheirTimeIsNear)
{
    const auto grip = [](const char* until) {
        return std::string("[time]\nframes = [1, 4]\nfps = 24\n") +
               "[[grip]]\nbody = \"box\"\nregion = { halfspace = { normal = "
               "[-1, 0, 0], offset = -1.7 } }\nmove = { velocity = [1, 2, 0] }\nuntil = " +
               until + "\n";
    };
    for (const char* until : {"0.041666667", "0.041666666", "0.0416667", "0.041665"}) {
        std::string text = box("", "");
        text.replace(text.find("[time]"), text.find("[grid]") - text.find("[time]"), grip(until));
        SceneRun run(text, {"time.substeps=1"});
        run.toEnd();
        EXPECT_EQ(run.steps.size(), 3u) << until;
        EXPECT_GT(run.steps[0].gripLoad[0].norm(), 1e-3);
        EXPECT_EQ(run.steps[1].gripLoad[0], Vec3(0, 0, 0)) << until;
    }
}

/// What two grips hold may not jump from the one to the other: known before the first step.
TEST(Grips, ThatTakeOverFromOthersDoNotJump)
{
    const auto grip = [](const char* rest) {
        return std::string(
                   "[[grip]]\nbody = \"box\"\nregion = { halfspace = { normal = [-1, 0, 0], offset = -1.7 } }\n") +
               rest;
    };
    const std::string still = grip("move = { velocity = [0, 0, 0] }\n"),
                      fast = grip("move = { velocity = [0, 4, 0] }\nuntil = 0.05\n");
    EXPECT_THROW(SceneRun(box("", still + fast)), InputError);
    EXPECT_NO_THROW(SceneRun(box("", fast + still)));  // the later one has had them all along
    EXPECT_THROW(SceneRun(box("", still + fast + fast)), InputError);
    SceneRun near(
        box("", grip("move = { velocity = [0, 0, 0] }\n") + grip("move = { velocity = [0, 0.1, 0] }\nuntil = 0.05\n")));
    EXPECT_NO_THROW(near.toFrame(8));
    const std::string later = grip("move = { velocity = [0, 4, 0] }\nuntil = 50\n");
    EXPECT_NO_THROW(SceneRun(box("", still + later)));  // after the last frame
}

/// Where a grip was, cracks run too once it has let go.
TEST(Grips, ThatHaveLetGoKeepNoCracksAway)
{
    SceneRun run(box("",
                     "[[grip]]\nbody = \"box\"\nregion.sphere.radius = 9\nmove = { velocity = [0, 0, 0] }\nuntil = 0"
                     ".02\n[[grip]]\nbody = \"box\"\nregion = { halfspace = { normal = [0, 1, 0], offset = -0.8 } }\n"
                     "move = { velocity = [0, 1, 0] }\n[fracture]\naverage = 0\nkappa = 1e-3\n"));
    run.toFrame(3);
    EXPECT_EQ(run.work.countOf("fracture", "moved_voxels"), 0);
    run.toFrame(8);
    EXPECT_GT(run.work.countOf("fracture", "moved_voxels"), 0);
}

/// Largest difference of velocity within a cell [m/s], between any two of its nodes.
double largestSpread(const core::Simulation& simulation)
{
    double most = 0;
    for (const core::Body& body : simulation.bodies())
        for (const auto& element : body.mesh->elements())
            for (const std::uint32_t a : element.node)
                for (const std::uint32_t b : element.node)
                    most = std::max(most,
                                    (simulation.v()[body.firstNode + a] - simulation.v()[body.firstNode + b]).norm());
    return most;
}

TEST(Steps, AutomaticOnesMoveNodesOfACellApartByNodeCflCellsAtMost)
{
    for (const double cfl : {1., 0.5, 0.15}) {
        SceneRun run(box("",
                         "[[grip]]\nbody = \"box\"\nregion.halfspace = { normal = \"x\", offset = 2.2 }\nmove.velocity "
                         "= [2, 0, 0]\n"),
                     {"time.substeps=\"auto\"", "time.fps=2", "time.node_cfl=" + std::to_string(cfl)});
        const double spread = largestSpread(run.simulation);
        EXPECT_NEAR(spread, 2, kRounding);  // of what is held, and of what is at rest beside it
        run.step();
        EXPECT_NEAR(run.steps.back().dt, 0.5 / std::ceil(0.5 / (cfl * 0.1 / spread)), kRounding) << cfl;
    }
}

/// A box that is wrung so hard that Newton's method gives steps up, and comes to rest.
TEST(Steps, AfterACutBackNoneIsTriedThatIsLongerThanTheLastOrTwiceAsLongAfterEachThatWasSolved)
{
    constexpr double kFrame = 0.1, kCell = 0.1;  // s, m
    SceneRun run(box("",
                     "[[grip]]\nbody = \"box\"\nregion.halfspace = { normal = \"x\", offset = 2.4 }\nmove = { pivot = "
                     "[2, -1, 3], keys = ["
                     "{ time = 0 }, { time = 0.05, rotate = [20, 0, 0] }] }\n"
                     "[[grip]]\nbody = \"box\"\nregion.halfspace = { normal = [-1, 0, 0], offset = -1.6 "
                     "}\nmove.velocity = [0, 0, 0]\n"
                     "[damping]\nmass = 20\nstiffness = 0.1\n"),
                 {"time.fps=10", "solver.newton_iterations=2", "solver.newton_tolerance=1e-3"});
    double trusted = 1e300;
    int cutbacks = 0, longer = 0;
    for (int n = 0; n < 12; ++n) {
        // Slow enough that no step is halved before it is tried.
        ASSERT_LT(largestSpread(run.simulation) * kFrame, 4 * kCell);
        const core::StepRecord step = run.step();
        const double tried = step.dt * std::exp2(step.cutbacks);
        EXPECT_LE(tried, trusted * (1 + kRounding)) << n;
        EXPECT_NE(step.outcome, core::Outcome::capped);
        longer += n > 0 && tried > 1.5 * run.steps[run.steps.size() - 2].dt;
        trusted = step.cutbacks > 0 ? step.dt : 2 * trusted;
        cutbacks += step.cutbacks;
    }
    EXPECT_GE(cutbacks, 3);
    EXPECT_GE(longer, 3);
    EXPECT_NEAR(run.steps.back().dt, kFrame, kRounding);
}

}  // namespace
