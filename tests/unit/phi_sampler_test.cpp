// phi between voxels: OpenVDB's trilinear interpolation behind a plain function.
#include "openvdb_access.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <openvdb/tools/LevelSetSphere.h>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

using namespace vdbfrac;

namespace {

constexpr double kDx = 0.1, kRadius = 1.7;

grid::LevelSet ball()
{
    return grid::wrap(
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(kRadius), openvdb::Vec3f(0), float(kDx), 3));
}

}  // namespace

TEST(PhiSampler, IsTheVoxelsAtVoxelsAndTheirMeanBetween)
{
    const grid::LevelSet level = ball();
    const auto phi = grid::phiSampler(level);
    const auto voxels = level.grid().grid->getConstAccessor();
    const double rounding = 1e-6 * kDx;  // of floats
    for (int k : {0, 3, 15, 17, 20}) {
        const double here = voxels.getValue({k, 2, 1}), next = voxels.getValue({k + 1, 2, 1});
        EXPECT_NEAR(phi(kDx * Vec3(k, 2, 1)), here, rounding);
        EXPECT_NEAR(phi(kDx * Vec3(k + .25, 2, 1)), .75 * here + .25 * next, rounding);
    }
}

TEST(PhiSampler, OutlivesItsLevelSetAndServesAllThreads)
{
    const auto phi = [] { return grid::phiSampler(ball()); }();
    constexpr std::size_t kCount = 20000;
    std::vector<double> error(kCount);
    parallelChunks(kCount, 100, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 X =
                kRadius *
                Vec3(std::sin(.1 * double(i)), std::cos(.1 * double(i)), std::sin(.07 * double(i))).normalized();
            error[i] = std::abs(phi(X));
        }
    });
    const double curvature =
        kDx * kDx / (4 * kRadius) * 2;  // of the distance to a ball between voxels, with the float's share
    for (double e : error) EXPECT_LT(e, curvature);
}

TEST(PhiSampler, MaterialBoxHoldsTheSurfaceWithRoom)
{
    const grid::LevelSet level = ball();
    const Bounds box = grid::materialBox(level);
    EXPECT_LE(box.lower.maxCoeff(), -kRadius - kDx);
    EXPECT_GE(box.lower.minCoeff(), -kRadius - 3 * kDx);
    EXPECT_GE(box.upper.minCoeff(), kRadius + kDx);
    EXPECT_LE(box.upper.maxCoeff(), kRadius + 3 * kDx);
}
