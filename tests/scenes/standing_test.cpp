// Bodies on a floor stand on all of their base, up to its edges, wherever those lie between the voxels.
#include "sled.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

using namespace vdbfrac;
using namespace vdbfrac::test;
using lab::SceneRun;

namespace {

constexpr double kDx = 0.01;  // m
constexpr double kRadian = std::numbers::pi / 180;

/// A stiff block on a floor that holds it, with gravity as on a slope.
struct Block {
    std::string lattice = "six";
    int coarsening = 1;
    double wide = 6, high = 6;  // voxels
    double offPlanes = 0;       // voxels, of all its faces
    double degrees = 0;

    std::string text() const
    {
        const double off = offPlanes * kDx, half = high * kDx / 2;
        return "version = 1\nname = \"block\"\n[time]\nframes = [1, 25]\nfps = 24\n[grid]\nvoxel_size = " +
               number(kDx) + "\nlattice = \"" + lattice + "\"\ncoarsening = " + std::to_string(coarsening) +
               "\n[[body]]\nname = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = " +
               vector(kDx * Vec3(wide, high, 6)) + ", center = " + vector(Vec3(off, off + half, off)) +
               " } }\n[material.gel]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n[gravity]\n"
               "acceleration = " +
               vector(onSlope(degrees * kRadian)) +
               "\n[damping]\nstiffness = 0.001\n[[collider]]\nname = \"floor\"\nfriction = 3\n"
               "shape = { halfspace = { normal = [0, -1, 0], offset = " +
               number(-off) + " } }\n";
    }
    /// Degrees by which it has turned from what it stood on in a second, and voxels by which it has moved.
    std::pair<double, double> moved() const
    {
        SceneRun run(text());
        const core::Simulation& s = run.simulation;
        const std::vector<Vec3> start(s.x().begin(), s.x().end());
        run.toEnd();
        const Vec3 from = mean(s, start), to = mean(s, s.x());
        Vec3 before = Vec3::Zero(), up = Vec3::Zero();
        for (std::size_t i = 0; i < start.size(); ++i) {
            const double moment = s.elastic().mass()[i] * (start[i] - from).y();
            before += moment * (start[i] - from), up += moment * (s.x()[i] - to);
        }
        const double cosine = before.normalized().dot(up.normalized());
        EXPECT_TRUE(std::isfinite(cosine));
        return {std::acos(std::min(1., cosine)) / kRadian, (to - from).norm() / kDx};
    }
};

/// As high as wide: it topples where the slope is steeper than 45 degrees, less what its edge gives way.
TEST(Collider, ABlockStandsOnAllOfItsBase)
{
    constexpr double kStands = 42, kTopples = 48, kStill = 3, kInPlace = .5, kAway = 6;  // degrees, voxels
    for (const Block& block : {Block{}, Block{.lattice = "five"}, Block{.coarsening = 2}, Block{.offPlanes = .3},
                               Block{.offPlanes = .5}, Block{.lattice = "five", .offPlanes = .3}}) {
        const std::string name = block.lattice + ", coarsening " + std::to_string(block.coarsening) + ", " +
                                 number(block.offPlanes) + " voxels off planes";
        Block tilted = block;
        tilted.degrees = kStands;
        const auto [turned, way] = tilted.moved();
        EXPECT_LT(turned, kStill) << name;
        EXPECT_LT(way, kInPlace) << name;
        tilted.degrees = kTopples;
        EXPECT_GT(tilted.moved().second, kAway) << name;  // it rolls on
    }
}

/// A wall as thick as two voxels stands by itself.
TEST(Collider, AThinWallStands)
{
    constexpr double kStill = 1, kInPlace = .5;  // degrees, voxels
    for (const double off : {0., .3}) {
        const auto [turned, way] = Block{.wide = 2, .offPlanes = off}.moved();
        EXPECT_LT(turned, kStill) << off;
        EXPECT_LT(way, kInPlace) << off;
    }
}

}  // namespace
