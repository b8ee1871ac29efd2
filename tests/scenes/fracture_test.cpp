// Fracture as a user sees it: what tears, where, at which load, at any resolution.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/lab/scenes/notched_plate.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

std::string notchedBlock() { return readText(std::string(VDBFRAC_SOURCE) + "/data/scenes/notched_block.toml"); }

grid::VoxelValues arrival(const SceneRun& run)
{
    for (const core::FrameSource* source : run.simulation.stages().frames)
        if (source->fields()[0].name == "arrival")
            return std::get<grid::VoxelValues>(source->take(run.simulation.bodies()[0], "arrival"));
    return {};
}

class NotchedBlock : public testing::TestWithParam<const char*> {};

TEST_P(NotchedBlock, TearsFromTheNotchIntoTwoLargeFragments)
{
    SceneRun run(notchedBlock(), {std::string("material.gel.poisson_ratio=") + GetParam()});
    run.toFrame(40);
    const core::Body& block = run.simulation.bodies()[0];
    std::vector<double> volumes;
    for (const auto& f : block.fragments.fragments()) volumes.push_back(f.restVolume);
    std::sort(volumes.rbegin(), volumes.rend());
    ASSERT_GE(volumes.size(), 2u);
    EXPECT_GT(volumes[1], 0.35 * block.startVolume);
    EXPECT_LT(run.simulation.volume() - volumes[0] - volumes[1], 0.02 * block.startVolume);  // chips

    const grid::VoxelValues failed = arrival(run);
    ASSERT_FALSE(failed.coords.empty());
    const std::size_t first =
        std::size_t(std::min_element(failed.scalars.begin(), failed.scalars.end()) - failed.scalars.begin());
    const Vec3 X = run.scene.grid.voxelSize * failed.coords[first].toVec();
    const double fromNotch = std::hypot(X.x() - 0.5, X.y()) - 0.2;  // the notch: radius .2 round (.5, 0)
    EXPECT_LT(fromNotch, 2 * run.scene.grid.voxelSize);
    EXPECT_LT(std::abs(X.y()), 0.2);
}

TEST_P(NotchedBlock, LoadRisesPeaksAndFallsToNothing)
{
    SceneRun run(notchedBlock(), {std::string("material.gel.poisson_ratio=") + GetParam()});
    run.toFrame(60);
    const double peak = run.peakLoad(0, 1);
    const auto& first = run.steps.front();
    const auto& last = run.steps.back();
    EXPECT_GT(peak, 2 * first.gripLoad[0].y());
    EXPECT_LT(std::abs(last.gripLoad[0].y()), 0.01 * peak);
    for (const core::StepRecord& s : run.steps) EXPECT_NE(s.outcome, core::Outcome::capped) << s.step;
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, NotchedBlock, testing::Values("0.1", "0.3", "0.49"));

/// On a Delaunay mesh the block tears as on the lattice: it starts to within a tenth of the same time, and bears
/// nothing in the end. A thread of tets may be left (README, what does not work yet).
TEST(NotchedBlockDelaunay, TearsAsOnTheLattice)
{
    struct Result {
        double onset = 0, peak = 0, end = 0;
    };
    const auto tear = [](const char* lattice) {
        SceneRun run(notchedBlock(),
                     {std::string("grid.lattice=") + lattice, "grid.voxel_size=0.0714285714", "time.substeps=4"});
        run.toFrame(36);
        Result r;
        for (const core::StepRecord& s : run.steps)
            if (r.onset == 0 && s.work.countOf("fracture", "moved_voxels") > 0) r.onset = s.time;
        r.peak = run.peakLoad(0, 1);
        r.end = run.steps.back().gripLoad[0].norm();
        return r;
    };
    const Result six = tear("\"six\""), delaunay = tear("\"delaunay\"");
    EXPECT_NEAR(delaunay.onset, six.onset, 0.1 * six.onset);
    EXPECT_NEAR(delaunay.peak, six.peak, 0.15 * six.peak);
    for (const Result& r : {six, delaunay}) EXPECT_LT(r.end, 0.05 * r.peak);
}

TEST(NotchedBlockLoss, IsLessThanACrackOneVoxelWide)
{
    constexpr double kLeast = .35;  // README.md: .4 to 1 voxel
    for (const char* voxel : {"0.05", "0.03125"}) {
        SceneRun run(notchedBlock(), {std::string("grid.voxel_size=") + voxel});
        run.toFrame(40);
        EXPECT_GE(run.simulation.fragments(), 2u);
        const double lost = 1 - run.simulation.volume() / run.simulation.startVolume();
        // Through .8 of a unit square, of a volume of .93.
        const double one = std::stod(voxel) * 0.8 / 0.93;  // of a crack one voxel wide
        EXPECT_GT(lost, kLeast * one) << voxel;
        EXPECT_LT(lost, one) << voxel;
    }
}

/// A smooth bar, nu = 0, a unit of it free between grips that reach round its ends (whose edges the level set rounds
/// off): the strain is the same everywhere between them. A step is longer than a wave needs along the bar. `law` is the
/// content of [fracture]; `speed` [m/s] of each end.
std::string bar(int cells, const std::string& law, double speed = 0.001)
{
    std::ostringstream s;
    s << "version = 1\nname = \"bar\"\n[time]\nframes = [1, 200]\nfps = 20\nsubsteps = 1\n[grid]\nvoxel_size = "
      << 1. / cells
      << "\n[[body]]\nname = \"bar\"\nshape = { box = { size = [0.25, 1.5, 0.25] } }\nmaterial = \"m\"\n[material.m]\n"
         "youngs_modulus = 1e6\npoisson_ratio = 0\ndensity = 1000\n"
         "[[grip]]\nname = \"top\"\nbody = \"bar\"\nregion = { halfspace = { normal = [0, 1, 0], offset = 0.5 } }\n"
         "move = { velocity = [0, "
      << speed
      << ", 0] }\n[[grip]]\nname = \"bottom\"\nbody = \"bar\"\n"
         "region = { halfspace = { normal = [0, -1, 0], offset = 0.5 } }\nmove = { velocity = [0, "
      << -speed << ", 0] }\n[fracture]\n"
      << law << "\n";
    return s.str();
}

constexpr double kIncrement = 0.002 / 20;  // strain of the bar a step

/// Strain at which the first voxel moves.
double tearingStrain(SceneRun& run)
{
    while (run.work.countOf("fracture", "moved_voxels") == 0 && run.steps.size() < 198)
        run.toFrame(int(run.steps.size()) + 2);
    return 0.002 * run.simulation.time();
}

TEST(BarOnset, StrainIsThatOfTheFormulaAtAnyResolution)
{
    const double E = 1e6, kappa = 50, critical = std::sqrt(2 * kappa / E);
    for (int cells : {8, 16, 32}) {
        SceneRun run(bar(cells, "kappa = 50"));
        const double strain = tearingStrain(run);
        std::printf("%d cells: torn at a strain of %.5f, critical %.5f\n", cells, strain, critical);
        EXPECT_NEAR(strain, critical, 1.001 * kIncrement) << cells;  // one load increment, and rounding
        // Force balance: the load is E e times the cross-section. That is a little more than volume by length: the
        // level set rounds off the edges of the ends, within a cell.
        const double load = run.steps.back().gripLoad[0].y(), section = run.simulation.startVolume() / 1.5;
        EXPECT_NEAR(load, E * strain * section, load * 0.5 / cells) << cells;
        EXPECT_NEAR(load, -run.steps.back().gripLoad[1].y(), 1e-3 * load) << cells;
    }
}

/// kappa = A Gc / l, l = 3 h, or .25 Gc / h without an average, h the spacing of the lattice (docs/physics.md): a
/// smooth bar tears where its energy E e^2 / 2 is that; under the driver tension, where that of its edges is G, and
/// where it is 3/2 of that at the latest.
TEST(BarOnset, UnderToughnessKappaIsThatOfTheTable)
{
    constexpr double kE = 1e6, strain = 0.01;
    struct Law {
        const char* keys;
        double factor;     // kappa h / Gc
        double least = 1;  // of the strain: where G may tear it
        double most = 1;
    };
    struct Grid {
        int cells, coarsening;
    };
    for (const Law& law :
         {Law{"", .341 / 3, 1.1, std::sqrt(1.5)}, Law{"driver = \"full\"\n", .336 / 3},
          Law{"average = 2\n", .341 / 2, 1.1, std::sqrt(1.5)}, Law{"average = 0\n", .25}, Law{"average = 0.5\n", .25}})
        for (const Grid& grid : {Grid{8, 1}, Grid{16, 1}, Grid{16, 2}}) {
            const double h = double(grid.coarsening) / grid.cells;
            std::ostringstream keys;
            keys.precision(17);
            keys << law.keys << "toughness = " << 0.5 * kE * strain * strain * h / law.factor;
            SceneRun run(bar(grid.cells, keys.str()), {"grid.coarsening=" + std::to_string(grid.coarsening)});
            const double torn = tearingStrain(run), late = 1.001 * kIncrement;  // a load increment, and rounding
            EXPECT_GE(torn, law.least * strain - late) << grid.cells << ", " << grid.coarsening << ", " << keys.str();
            EXPECT_LE(torn, law.most * strain + late) << grid.cells << ", " << grid.coarsening << ", " << keys.str();
        }
}

TEST(BarOnset, UnderTensionIsThatOfTheStressOfAnyStrain)
{
    SceneRun linear(bar(8, "kappa = 50"), {"solver.strain=\"linear\""}),
        green(bar(8, "kappa = 50"), {"solver.strain=\"green\""});
    EXPECT_NEAR(tearingStrain(linear), 0.01, 1.001 * kIncrement);
    EXPECT_NEAR(tearingStrain(green), std::sqrt(1.02) - 1, 1.001 * kIncrement);  // e + e^2 / 2 = .01
}

/// A strip a metre high and three long, clamped along both sides, slit for a third of its length: a crack releases what
/// it had stored ahead, G = E e^2 H / 2 (nu = 0; Rivlin & Thomas 1953), wherever its tip is.
std::string clampedStrip(int cells, double toughness, double from, double to, int steps)
{
    const double dx = 1. / cells;
    std::ostringstream s;
    s.precision(17);
    s << "version = 1\nname = \"strip\"\n[time]\nframes = [1, " << steps + 1
      << "]\nfps = 1\nsubsteps = 1\n[grid]\nvoxel_size = " << dx
      << "\n[solver]\nintegrator = \"static\"\n[[body]]\nname = \"strip\"\nmaterial = \"m\"\nshape = { box = { size = "
         "[3, 1.4, "
      << 2.5 * dx << "], center = [0.013, 0, 0] } }\ncut = [{ box = { size = [2, " << 0.6 * dx
      << ", 1], center = [-1.5, 0, 0] } }]\n[material.m]\nyoungs_modulus = 1e6\npoisson_ratio = 0\ndensity = 1000\n";
    for (const double side : {1., -1.})
        s << "[[grip]]\nbody = \"strip\"\nregion = { halfspace = { normal = [0, " << side
          << ", 0], offset = 0.5 } }\nmove.keys = [{ time = 0, translate = [0, " << side * from / 2
          << ", 0] }, { time = " << steps << ", translate = [0, " << side * to / 2 << ", 0] }]\n";
    s << "[fracture]\ntoughness = " << toughness << "\ngrip_margin = 0.1\n";
    return s.str();
}

/// G / Gc at which the crack of a strip sets off at its tip; NaN: it does not tear there.
double releaseAtOnset(int cells, const std::vector<std::string>& law)
{
    constexpr double kGc = 200, kE = 1e6, kFrom = 0.85, kTo = 1.25;  // J/m^2, Pa; of the critical strain
    constexpr int kSteps = 100;
    const double critical = std::sqrt(2 * kGc / kE);
    SceneRun run(clampedStrip(cells, kGc, kFrom * critical, kTo * critical, kSteps), law);
    while (arrival(run).coords.empty() && int(run.steps.size()) < kSteps) run.step();
    if (arrival(run).coords.empty() || run.steps.size() <= 5u) return NAN;
    for (const Coord& voxel : arrival(run).coords)
        EXPECT_LT((run.scene.grid.voxelSize * voxel.toVec() - Vec3(-0.5, 0, 0)).head<2>().norm(), 0.2);
    const double strain = critical * (kFrom + (kTo - kFrom) * double(run.steps.size()) / kSteps),
                 release = 0.5 * kE * strain * strain / kGc;
    std::printf("%d cells: the crack sets off at G = %.3f Gc\n", cells, release);
    return release;
}

TEST(ClampedStrip, CrackSetsOffWhereTheEnergyThatItReleasesIsTheToughness)
{
    // A of docs/physics.md is that of cracks that run; how they set off depends on the end of the slit.
    constexpr double kCalibration = 0.1;
    EXPECT_NEAR(releaseAtOnset(20, {}), 1, kCalibration);
}

TEST(ClampedStrip, WithoutAnAverageToo)
{
    // C of docs/physics.md is one number for many shapes; a strip 10 cells high is .1 above it. Of finer ones, and of
    // cracks that run, this says nothing.
    constexpr double kCalibration = 0.15;
    EXPECT_NEAR(releaseAtOnset(10, {"fracture.average=0", "fracture.driver=\"full\"", "solver.mean_strain=0"}), 1,
                kCalibration);
}

bool isNoted(const SceneRun& run, const std::string& text)
{
    const auto& notes = run.simulation.stages().notes;
    return std::any_of(notes.begin(), notes.end(),
                       [&](const std::string& n) { return n.find(text) != std::string::npos; });
}

TEST(BarOnset, KeysScaleTheResistanceOverTime)
{
    // kappa = 50 (1 - .24 t) meets the energy E e^2 / 2 = 2 t^2 of the strain e = .002 t at t = sqrt(34) - 3.
    SceneRun run(bar(16, "kappa = 50\nkeys = [{ time = 0, scale = 1 }, { time = 4, scale = 0.04 }]"));
    EXPECT_NEAR(tearingStrain(run), 0.002 * (std::sqrt(34.) - 3), 1.001 * kIncrement);
}

TEST(BarOnset, KeysThatAreOneChangeNothing)
{
    const auto hash = [](const std::string& keys) {
        SceneRun run(bar(8, "kappa = 0.5" + keys));
        run.toFrame(40);
        EXPECT_GT(run.work.countOf("fracture", "moved_voxels"), 0);
        return run.simulation.stateHash();
    };
    EXPECT_EQ(hash(""), hash("\nkeys = [{ time = 1, scale = 1 }]"));
}

/// To the bit as where [fracture] says so of all; what it says of others is not for this one.
TEST(BarOnset, MaterialsMayHaveTheirOwn)
{
    const auto hash = [](const std::string& law) {
        SceneRun run(bar(8, law));
        run.toFrame(40);
        return run.simulation.stateHash();
    };
    const std::string own = "\n[[fracture.material]]\nname = \"m\"\n";
    const std::uint64_t weak = hash("kappa = 0.5"), tough = hash("toughness = 20\nstrength = 4e3");
    EXPECT_NE(weak, tough);
    EXPECT_EQ(hash("kappa = 0.5" + own + "toughness = 20\nstrength = 4e3"), tough);
    EXPECT_EQ(hash("toughness = 9" + own + "kappa = 0.5"), weak);
    for (const char* wrong : {"kappa = 1\ntoughness = 1", "strength = 1", "kappa = 1\nstrength = 1", "kappa = 0"})
        EXPECT_THROW(SceneRun(bar(8, "kappa = 1" + own + wrong)), InputError) << wrong;
    EXPECT_THROW(SceneRun(bar(8, "kappa = 1\n[[fracture.material]]\nname = \"n\"\nkappa = 1")), InputError);
}

TEST(Front, ThatTheStepHoldsBackIsCounted)
{
    const auto held = [](const char* frontCfl, int fps) {
        SceneRun run(bar(8, "kappa = 0.5", 0.1),
                     {std::string("time.front_cfl=") + frontCfl, "time.fps=" + std::to_string(fps)});
        run.toFrame(fps * 8 / 100);
        EXPECT_GT(run.work.countOf("fracture", "moved_voxels"), 0);
        return run.work.countOf("fracture", "held_back");
    };
    EXPECT_GT(held("0.5", 100), 0);  // c_R dt is 1.5 voxels, and the energy four times the resistance
    EXPECT_EQ(held("1", 200), 0);    // .75 voxels
}

TEST(BarOnset, StrengthIsTheStressThatTears)
{
    // Averaged over 2 * .341 E Gc / strength^2 = .44 m, seven voxels: both numbers can be honoured.
    SceneRun run(bar(16, "toughness = 65\nstrength = 1e4"));
    EXPECT_FALSE(isNoted(run, "toughness is honoured"));
    EXPECT_NEAR(tearingStrain(run), 1e4 / 1e6, 1.001 * kIncrement);
}

TEST(BarOnset, StrengthThatTheGridCannotResolveIsSaid)
{
    SceneRun run(bar(16, "toughness = 10\nstrength = 1e4")), without(bar(16, "toughness = 10"));
    EXPECT_TRUE(isNoted(run, "toughness is honoured"));
    EXPECT_EQ(tearingStrain(run), tearingStrain(without));
    EXPECT_TRUE(std::ranges::equal(run.simulation.x(), without.simulation.x()));
}

TEST(BarOnset, UnderTensionDriverSqueezingDoesNotTear)
{
    SceneRun full(bar(8, "kappa = 50\ndriver = \"full\"", -0.001)), tension(bar(8, "kappa = 50", -0.001));
    EXPECT_NEAR(tearingStrain(full), 0.01, 1.001 * kIncrement);
    tension.toFrame(150);
    EXPECT_EQ(tension.work.countOf("fracture", "moved_voxels"), 0);
    SceneRun pulled(bar(8, "kappa = 50"));
    EXPECT_NEAR(tearingStrain(pulled), 0.01, 1.001 * kIncrement);
    SceneRun delaunay(bar(8, "kappa = 50"), {"grid.lattice=\"delaunay\""});
    // Its nodes leave the free length open by a cell at each grip.
    EXPECT_NEAR(tearingStrain(delaunay), 0.01, 2 * 0.01 / 8);
}

TEST(Grips, ForceIsRampedAndFoundAgainAtTheOtherEnd)
{
    std::string text = bar(8, "kappa = 1e9");
    const std::string from = "move = { velocity = [0, 0.001, 0] }";
    text.replace(text.find(from), from.size(), "move = { force = [0, 120, 0], ramp = 1 }");
    SceneRun run(text);
    run.toFrame(11);  // half a second
    EXPECT_NEAR(run.steps.back().gripLoad[0].y(), 60, 1e-9);
    run.toFrame(120);
    EXPECT_NEAR(run.steps.back().gripLoad[0].y(), 120, 1e-9);
    // At rest but for the slow pull of the other end: what is left of the ramp's waves is damped.
    EXPECT_NEAR(run.steps.back().gripLoad[1].y(), -120, 0.12);
}

/// Else it would be m v / dt of the nodes it holds.
TEST(Grips, TheLoadOfTheFirstStepDoesNotGrowAsTheStepGetsShorter)
{
    const std::string from = "move = { velocity = [0, 0.001, 0] }";
    for (const char* move :
         {"move = { velocity = [0, 0.1, 0] }", "move.keys = [{ time = 0 }, { time = 1, translate = [0, 0.1, 0] }]",
          "move.keys = [{ time = 0 }, { time = 1, rotate = [0, 0, 20] }]"}) {
        std::string text = bar(8, "kappa = 1e9");
        text.replace(text.find(from), from.size(), move);
        SceneRun slow(text), fast(text, {"time.substeps=1000"});
        EXPECT_LT(fast.step().gripLoad[0].norm(), slow.step().gripLoad[0].norm()) << move;
    }
}

TEST(Grips, KeysTurnAndMoveRoundThePivot)
{
    std::string text = bar(8, "kappa = 1e9");
    const std::string from = "move = { velocity = [0, 0.001, 0] }";
    text.replace(text.find(from), from.size(),
                 "move = { pivot = [0, 0.5, 0], keys = [{ time = 0 }, { time = 1, translate = [0, 0.02, 0], rotate = "
                 "[0, 90, 0] }] }");
    SceneRun run(text);
    run.toFrame(21);
    const core::Body& body = run.simulation.bodies()[0];
    for (std::size_t i = 0; i < body.mesh->nodeCount(); ++i) {
        const Vec3 X = body.mesh->restPosition(i);
        if (X.y() < 0.5 - 1e-6) continue;
        EXPECT_LT((run.simulation.x()[i] - Vec3(X.z(), X.y() + 0.02, -X.x())).norm(), 1e-12);  // 90 degrees about y
    }
}

/// Peak load on the plate [N].
double peakLoad(int cells, const std::string& law)
{
    const double peak = lab::notchedPlatePeak(cells, law);
    EXPECT_GT(peak, 0) << "the plate did not tear";
    return peak;
}

TEST(NotchedPlate, PeakLoadUnderToughnessDoesNotDependOnResolution)
{
    double least = 1e300, most = 0;
    for (int cells : {10, 20, 40}) {
        const double peak = peakLoad(cells, "toughness = 400");
        std::printf("toughness, %d cells: peak load %.1f N\n", cells, peak);
        least = std::min(least, peak), most = std::max(most, peak);
    }
    EXPECT_LE(most / least, 1.1);
}

TEST(NotchedPlate, PeakLoadUnderFixedKappaFallsWithTheRootOfTheSpacing)
{
    const double coarse = peakLoad(10, "kappa = 2000"), fine = peakLoad(40, "kappa = 2000");
    std::printf("kappa, 10 cells: %.1f N, 40 cells: %.1f N\n", coarse, fine);
    // Order in h: .5, less what the bounded stress far from the tip adds at 10 cells.
    const double order = std::log(coarse / fine) / std::log(4.);
    EXPECT_NEAR(order, 0.5, 0.15);
}

}  // namespace
