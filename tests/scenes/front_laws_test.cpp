// What the keys of fracture and of time steps say of a front, in numbers that are known: on rods strained alike
// everywhere.
#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <sstream>

using namespace vdbfrac;
using lab::Rod;
using lab::SceneRun;

namespace {

constexpr double kStored = 1e-6;  // of a voxel: phi is kept as floats of up to three voxels

std::string fracture(double kappa, const std::string& more = "")
{
    std::ostringstream s;
    s.precision(17);
    s << "[fracture]\naverage = 0\nkappa = " << kappa << "\n" << more << "\n";
    return s.str();
}

/// Distance [m] of a voxel from the grips at rest, in the free length.
double fromGrips(const SceneRun& run, Coord voxel) { return Rod::kFree - std::abs(run.scene.grid.voxelSize * voxel.y); }

/// How far phi rose in a step [m] at the voxels next to the surface, away from the grips: re-levelling leaves them as
/// they were raised.
std::map<Coord, std::pair<double, double>> besideTheSurface(SceneRun& run)
{
    const double dx = run.scene.grid.voxelSize;
    const core::Body& body = run.simulation.bodies()[0];
    const auto before = lab::materialPhi(body);
    run.step();
    std::map<Coord, std::pair<double, double>> phi;
    for (const auto& [voxel, value] : before)
        if (value > -0.5 * dx && fromGrips(run, voxel) > 4 * dx) phi[voxel] = {value, double(body.mesh->phi()(voxel))};
    return phi;
}

/// The law in closed form: eps phi + phi^3 / (3 eps) grows by front_speed c_R eps dt (1 - kappa / Psi).
TEST(Front, MovesTheFasterTheMoreItIsOverloaded)
{
    // Of a voxel, that a Rayleigh wave goes in the step: less than front_cfl and re-levelling allow.
    constexpr double kPart = 0.2;
    constexpr double kAllowed = 1e-4;  // of the rise: floats, and the strain as it was solved
    Rod rod;
    rod.frame = kPart * rod.dx / rod.rayleighSpeed();
    for (const double speed : {1., 0.25})
        for (const double ratio : {4., 1.5}) {
            SceneRun run(rod.text(fracture(rod.energy() / ratio, "front_speed = " + std::to_string(speed))));
            const double eps = 1.25 * rod.dx, travel = speed * kPart * rod.dx * (1 - 1 / ratio);
            const auto integral = [&](double phi) { return eps * phi + phi * phi * phi / (3 * eps); };
            const auto phi = besideTheSurface(run);
            ASSERT_GT(phi.size(), 100u);
            double least = 1e300, most = 0;
            for (const auto& [voxel, value] : phi) {
                const double grown = (integral(value.second) - integral(value.first)) / eps;
                least = std::min(least, grown / travel), most = std::max(most, grown / travel);
            }
            std::printf("front_speed %g, Psi = %g kappa: the front went %.6f to %.6f of what it should\n", speed, ratio,
                        least, most);
            EXPECT_NEAR(least, 1, kAllowed);
            EXPECT_NEAR(most, 1, kAllowed);
        }
}

TEST(Front, ThatCouldGoFartherMovesByFrontCflVoxelsInAStepOfFixedLength)
{
    Rod rod;  // in whose step a Rayleigh wave goes thirty voxels
    for (const double cfl : {0.1, 0.25, 0.5}) {
        SceneRun run(rod.text(fracture(1e-3 * rod.energy())), {"time.front_cfl=" + std::to_string(cfl)});
        const auto phi = besideTheSurface(run);
        ASSERT_GT(phi.size(), 100u);
        for (const auto& [voxel, value] : phi) EXPECT_NEAR((value.second - value.first) / rod.dx, cfl, kStored) << cfl;
    }
}

TEST(Front, OnceItMovesAutomaticStepsTakeARayleighWaveNoFartherThanFrontCflVoxels)
{
    constexpr double kRounding = 1e-9;
    Rod rod;
    rod.substeps = 0;
    for (const double cfl : {0.25, 0.5, 1.}) {
        SceneRun run(rod.text(fracture(1e-3 * rod.energy())), {"time.front_cfl=" + std::to_string(cfl)});
        run.step();
        EXPECT_NEAR(run.steps.back().dt, rod.frame, kRounding * rod.frame);  // nothing had moved
        EXPECT_GT(run.work.countOf("fracture", "moved_voxels"), 0);
        run.step();
        const double limit = cfl * rod.dx / rod.rayleighSpeed();
        EXPECT_NEAR(run.steps.back().dt, rod.frame / std::ceil(rod.frame / limit), kRounding * rod.frame) << cfl;
    }
}

TEST(Fracture, StopsAtTheMarginOfTheGripsAndNotBeforeIt)
{
    constexpr double kRounding = 1e-9;  // m
    Rod rod;
    struct Margin {
        const char* key;
        double width;  // m
    };
    for (const Margin& margin :
         {Margin{"", 2 * rod.dx}, Margin{"grip_margin = 0", 0}, Margin{"grip_margin = 0.3", 0.3}}) {
        SceneRun run(rod.text(fracture(1e-6 * rod.energy(), margin.key)));
        for (int n = 0; n < 8; ++n) run.step();  // half a voxel each: more than half of the rod's width
        double nearest = 1e300;
        for (const Coord& voxel : lab::fieldOf(run, "arrival").coords)
            nearest = std::min(nearest, fromGrips(run, voxel));
        EXPECT_GE(nearest, margin.width - kRounding) << margin.key;
        EXPECT_LT(nearest, margin.width + rod.dx) << margin.key;
    }
}

TEST(Arrival, IsTheEndOfTheStepInWhichPhiRoseToZero)
{
    Rod rod;
    rod.frame = 0.4 * rod.dx / rod.rayleighSpeed();
    SceneRun run(rod.text(fracture(rod.energy() / 3)));
    const core::Body& body = run.simulation.bodies()[0];
    std::map<Coord, float> expected;
    for (int n = 0; n < 12; ++n) {
        const auto before = lab::materialPhi(body);
        run.step();
        for (const auto& [voxel, value] : before)
            if (body.mesh->phi()(voxel) >= 0) expected[voxel] = float(run.simulation.time());
    }
    const grid::VoxelValues arrival = lab::fieldOf(run, "arrival");
    ASSERT_EQ(arrival.coords.size(), expected.size());
    std::set<float> times;
    for (std::size_t i = 0; i < arrival.coords.size(); ++i) {
        const auto it = expected.find(arrival.coords[i]);
        ASSERT_NE(it, expected.end()) << arrival.coords[i].toVec().transpose();
        EXPECT_EQ(arrival.scalars[i], it->second) << arrival.coords[i].toVec().transpose();
        times.insert(it->second);
    }
    EXPECT_GT(expected.size(), 100u);
    EXPECT_GE(times.size(), 3u);  // layers, one after the other
}

/// All lengths times L, and with them toughness and times: the same body of another unit of length.
std::string notchedCubeOf(double L)
{
    std::ostringstream s;
    s.precision(17);
    s << "version = 1\nname = \"cube\"\ngrid = { voxel_size = " << .1 * L
      << " }\ntime = { frames = [1, 8], fps = " << 24 / L << " }\n[[body]]\nname = \"cube\"\nshape = { box = { size = ["
      << .98 * L << ", " << .98 * L << ", " << .98 * L
      << "] } }\ncut = [{ cylinder = { axis = \"z\", radius = " << .3 * L << ", center = [" << .5 * L
      << ", 0, 0] } }]\nmaterial = \"gel\"\n[material]\n"
      << "gel = { youngs_modulus = 1e5, poisson_ratio = 0.3, density = 1000 }\n[[grip]]\nbody = \"cube\"\n"
      << "region = { halfspace = { normal = \"y\", offset = " << .4 * L << " } }\nmove = { velocity = [0, 3, 0] }\n"
      << "[fracture]\ntoughness = " << 100 * L << "\n";
    return s.str();
}

/// Below voxels of a centimetre, where constants of levelling go by their size: a power of two in the lengths changes
/// no bit of a number but its exponent.
TEST(Front, GoesTheSameWayInBodiesOfAnySize)
{
    const double large = 0x1p-4, small = 0x1p-12;
    SceneRun one(notchedCubeOf(large)), other(notchedCubeOf(small));
    one.toEnd(), other.toEnd();
    ASSERT_EQ(one.simulation.fragments(), 2u);
    ASSERT_EQ(other.steps.size(), one.steps.size());
    const double ratio = std::pow(small / large, 3);
    EXPECT_EQ(other.steps.back().volume, ratio * one.steps.back().volume);
    EXPECT_EQ(other.steps.back().elasticEnergy, ratio * one.steps.back().elasticEnergy);
    EXPECT_EQ(other.steps.back().kineticEnergy, ratio * one.steps.back().kineticEnergy);
}

}  // namespace
