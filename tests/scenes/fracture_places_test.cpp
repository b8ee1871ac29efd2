// Bodies that are weaker in some places than in others: what each place bears, and where they tear.
#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kE = 1e6, kKappa = 61, kRate = .005;        // Pa, J/m^3, strain a second
const double kTearing = std::sqrt(2 * kKappa / kE) / kRate;  // s

/// A bar, a metre of it free, pulled without inertia. Its surface is a voxel outside of .125 x .125 m. `more`: of
/// [fracture]; `fields`: of frames.
std::string bar(const std::string& more, double voxel = .0625, const std::string& fields = "\"phi\"")
{
    std::ostringstream s;
    s << "version = 1\nname = \"bar\"\n[time]\nframes = [1, 90]\nfps = 32\nsubsteps = 1\n[grid]\nvoxel_size = " << voxel
      << "\n[solver]\nintegrator = \"static\"\nnewton_tolerance = 1e-8\n"
         "[[body]]\nname = \"bar\"\nshape = { box = { size = ["
      << .125 + 2 * voxel << ", 1.5, " << .125 + 2 * voxel
      << "] } }\nmaterial = \"m\"\n[material.m]\n"
         "poisson_ratio = 0\ndensity = 1000\nyoungs_modulus = "
      << kE << "\n";
    for (const double side : {1., -1.})
        s << "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [0, " << side
          << ", 0], offset = 0.5 } }\nmove = { velocity = [0, " << side * kRate / 2 << ", 0] }\n";
    s << "[output]\nvdb = [" << fields << "]\n[fracture]\ngrip_margin = 0.125\nkappa = " << kKappa << "\n" << more;
    return s.str();
}

/// Psi / kappa at places of the surface, before anything tears; places in sixteenths of a metre.
std::map<Coord, double> margins(const std::string& more, int perVoxel = 1)
{
    SceneRun run(bar(more, .0625 / perVoxel, "\"margin\""));
    run.toFrame(30);
    EXPECT_EQ(run.work.countOf("fracture", "moved_voxels"), 0);
    const grid::VoxelValues values = lab::fieldOf(run, "margin");
    std::map<Coord, double> at;
    for (std::size_t i = 0; i < values.coords.size(); ++i) {
        const Coord& c = values.coords[i];
        if (c.x % perVoxel == 0 && c.y % perVoxel == 0 && c.z % perVoxel == 0)
            at[{c.x / perVoxel, c.y / perVoxel, c.z / perVoxel}] = double(values.scalars[i]);
    }
    return at;
}

constexpr const char* kSpot = "spots = [{ center = [0.0625, 0.1875, 0], radius = 0.3, factor = 0.25 }]\n";
double factorOfSpot(const Vec3& X)
{
    const double r = std::min(1., (X - Vec3(.0625, .1875, 0)).norm() / .3);
    return 1 - .75 * std::pow(1 - r * r, 2);
}

TEST(FracturePlaces, HaveTheResistanceOfTheirSpot)
{
    constexpr double kFloat = 1e-6;
    for (const std::string law : {"", "driver = \"tension\"\naverage = 2\n"}) {
        const auto plain = margins(law), spotted = margins(law + kSpot);
        ASSERT_GT(plain.size(), 100u);
        double least = 1;
        for (const auto& [voxel, margin] : plain) {
            const double factor = factorOfSpot(.0625 * voxel.toVec());
            EXPECT_NEAR(spotted.at(voxel) * factor / margin, 1, kFloat);
            least = std::min(least, factor);
        }
        EXPECT_LT(least, .26);
    }
}

/// Noise between 1 - s and 1 + s: that of the place at rest, whatever the lattice; another number, another noise.
TEST(FracturePlaces, ScatterByPlaceAndSeed)
{
    constexpr double kFloat = 1e-6;
    const auto factors = [](const std::string& seed, int perVoxel) {
        const std::string scatter = "scatter = 0.4\nscatter_size = 0.125\nscatter_seed = " + seed + "\n";
        const auto plain = margins("", perVoxel);
        std::map<Coord, double> factors;
        for (const auto& [voxel, margin] : margins(scatter, perVoxel)) factors[voxel] = plain.at(voxel) / margin;
        return factors;
    };
    const auto wide = factors("3", 1), other = factors("4", 1), fine = factors("3", 2);
    double least = 1, most = 1, apart = 0;
    for (const auto& [voxel, factor] : wide) {
        least = std::min({least, factor, other.at(voxel)}), most = std::max({most, factor, other.at(voxel)});
        apart = std::max(apart, std::abs(other.at(voxel) - factor));
    }
    EXPECT_GT(least, .6 - kFloat);
    EXPECT_LT(most, 1.4 + kFloat);
    EXPECT_LT(least, .85);
    EXPECT_GT(most, 1.15);
    EXPECT_GT(apart, .2);
    std::size_t shared = 0;
    for (const auto& [voxel, factor] : fine)
        if (const auto same = wide.find(voxel); same != wide.end()) {
            EXPECT_NEAR(factor, same->second, kFloat);
            ++shared;
        }
    EXPECT_GT(shared, 20u);
}

/// Where a bar is a quarter as resistant it tears at half the strain, under each driver, and there.
TEST(FracturePlaces, TearWhereTheyAreWeakest)
{
    constexpr double kIncrement = 1. / 32;  // s
    for (const std::string law : {"", "driver = \"full\"\n", "driver = \"full\"\naverage = 0\n", "average = 0\n"}) {
        SceneRun run(bar(law + kSpot));
        while (run.work.countOf("fracture", "moved_voxels") == 0 && run.steps.size() < 80) run.step();
        EXPECT_NEAR(run.simulation.time(), kTearing / 2, 1.5 * kIncrement) << law;
        while (lab::fieldOf(run, "arrival").coords.empty() && run.steps.size() < 80) run.step();
        const grid::VoxelValues arrival = lab::fieldOf(run, "arrival");
        ASSERT_FALSE(arrival.coords.empty()) << law;
        for (const Coord& c : arrival.coords) EXPECT_LT(factorOfSpot(.0625 * c.toVec()), .5) << law;
    }
}

/// Under a toughness too, at tips and at smooth faces: a spot of .25 that holds the body is a quarter of the toughness.
TEST(FracturePlaces, AreLikeAnotherToughnessWhereTheyHoldAll)
{
    constexpr const char* kHold = "spots = [{ center = [0, 0, 0], radius = 1e9, factor = 0.25 }]\n";
    const auto arrivals = [](const std::string& resistance) {
        std::string text = bar("");
        text.replace(text.find("kappa = "), std::string::npos, resistance);
        text.insert(text.find("material = "),
                    "cut = [{ box = { size = [0.2, 0.0625, 1], center = [0.125, 0, 0] } }]\n");
        SceneRun run(text);
        run.toEnd();
        return lab::fieldOf(run, "arrival");
    };
    const grid::VoxelValues held = arrivals("toughness = 40\n" + std::string(kHold)),
                            weak = arrivals("toughness = 10\n");
    ASSERT_GT(weak.coords.size(), 5u);
    EXPECT_EQ(held.coords, weak.coords);
    EXPECT_EQ(held.scalars, weak.scalars);
}

/// Few voxels are looked at where the load is low, however many spots there are elsewhere.
TEST(FracturePlaces, CostNothingWhereTheLoadIsLow)
{
    const auto looked = [](const std::string& law, int spots) {
        std::string list = law + "spots = [";
        for (int i = 0; i < spots; ++i)
            list += "{ center = [0, " + std::to_string(.07 * i - .7) + ", 0], radius = 0.06, factor = 0.3 }, ";
        SceneRun run(bar(list + "]\n"));
        run.toFrame(10);
        return run.work.countOf("fracture", "voxels");
    };
    for (const char* law : {"", "driver = \"full\"\n"}) EXPECT_EQ(looked(law, 20), looked(law, 1)) << law;
}

/// What does nothing, or what the user did not choose, is told.
TEST(FracturePlaces, TellWhatTheyDoNotDo)
{
    const auto notes = [](const std::string& more) {
        std::string all;
        const SceneRun run(bar(more));
        for (const std::string& note : run.simulation.stages().notes) all += note + "\n";
        return all;
    };
    EXPECT_NE(notes("scatter = 0.4\n").find("scatter_size is 0.375 m here"), std::string::npos);
    EXPECT_NE(notes("scatter = 0.4\nscatter_size = 0.01\n").find("counts as a lattice cell, 0.0625 m"),
              std::string::npos);
    EXPECT_NE(notes("spots = [{ center = [9, 0, 0], radius = 1, factor = 0.5 }]\n").find("spots[0] is in no body"),
              std::string::npos);
    EXPECT_EQ(notes("scatter = 0.4\nscatter_size = 0.3\n" + std::string(kSpot)), notes(""));
}

/// A smooth bar that is pulled apart tears at all of its surface at once. One that is not the same everywhere tears at
/// one place, and little is lost.
TEST(FracturePlaces, SmoothBarsThatScatterLoseLittle)
{
    const auto lost = [](const std::string& more) {
        std::string text =
            "version = 1\nname = \"bar\"\ntime = { frames = [1, 48], fps = 24 }\ngrid = { voxel_size = 0.045 }\n"
            "[[body]]\nname = \"bar\"\nshape = { box = { size = [0.36, 1.2, 0.36] } }\nmaterial = \"gel\"\n"
            "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.4\ndensity = 1000\n[damping]\nstiffness = 0.002\n";
        for (const char* side : {"1", "-1"})
            text += "[[grip]]\nbody = \"bar\"\nregion = { halfspace = { normal = [0, " + std::string(side) +
                    ", 0], offset = 0.5 } }\nmove = { velocity = [0, " + side + "e-1, 0] }\n";
        SceneRun run(text + "[fracture]\ntoughness = 150\n" + more);
        run.toEnd();
        EXPECT_GT(run.simulation.fragments(), 1) << more;
        const double share = 1 - run.simulation.volume() / run.simulation.startVolume();
        std::printf("%s: %d fragments, lost %.1f %%\n", more.c_str(), int(run.simulation.fragments()), 100 * share);
        return share;
    };
    const double plain = lost("");
    for (const char* seed : {"0", "1", "2"})
        EXPECT_LT(lost("scatter = 0.4\nscatter_size = 0.3\nscatter_seed = " + std::string(seed)), .6 * plain);
}

}  // namespace
