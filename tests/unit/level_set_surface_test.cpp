// What a level set encloses, and its surface.
#include "openvdb_access.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/level_set_surface.h>

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

using namespace vdbfrac;

namespace {

constexpr double kDx = 0.1;

openvdb::FloatGrid::Ptr ball(double radius, const openvdb::Vec3f& center)
{
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(radius), center, float(kDx), 3);
}
double ballVolume(double r) { return 4 * std::numbers::pi / 3 * r * r * r; }

}  // namespace

TEST(LevelSetSurface, VolumeOfABallConvergesSecondOrder)
{
    // phi between voxels is lower than the distance by about dx^2 / (4 r): the ball seems larger by area times that.
    for (double radius : {.55, 1.2, 4.1}) {
        const double bias = 4 * std::numbers::pi * radius * kDx * kDx / 4;
        EXPECT_NEAR(grid::enclosedVolume(grid::wrap(ball(radius, {.03f, -.02f, .01f}))), ballVolume(radius), 2 * bias)
            << radius;
    }
}

TEST(LevelSetSurface, VolumeOfABoxDoesNotDependOnWhereItsFacesLie)
{
    const Vec3 sides(1, .6, .4);
    for (double dx : {.05, .03, .027, .0234}) {
        scene::Body body;
        body.shape = Primitive{.center = Vec3(.013, -.007, .004), .size = sides};
        scene::Grid grid;
        grid.voxelSize = dx;
        // The trilinear phi rounds the twelve edges off, by less than a fifth of a voxel's face.
        const double rounded = 4 * sides.sum() * .2 * dx * dx;
        EXPECT_NEAR(grid::enclosedVolume(grid::makeLevelSet(body, grid, std::uint64_t(1) << 30)), sides.prod(), rounded)
            << dx;
    }
}

TEST(LevelSetSurface, VolumeHasTheSameBitsForAnyNumberOfThreads)
{
    const auto phi = grid::wrap(ball(2.3, {0, 0, 0}));
    const auto volume = [&](int threads) {
        const ThreadLimit limit(threads);
        return grid::enclosedVolume(phi);
    };
    EXPECT_EQ(volume(1), volume(3));
}

TEST(LevelSetSurface, IsClosedOutwardAndNamesPartsBySize)
{
    auto both = ball(.5, {-2, 0, 0});
    auto large = ball(1, {2, 0, 0});
    openvdb::tools::csgUnion(*both, *large);
    const tetmesh::Surface surface = grid::surfaceOf(grid::wrap(both), 0);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double volume[2] = {};
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const auto& c = surface.triangles[t];
        for (std::size_t k = 0; k < 3; ++k) ++edges[{c[k], c[(k + 1) % 3]}];
        ASSERT_LT(surface.fragment[t], 2u);
        volume[surface.fragment[t]] += surface.points[c[0]].dot(surface.points[c[1]].cross(surface.points[c[2]])) / 6;
        EXPECT_EQ(surface.torn[t], 0);
    }
    for (const auto& [edge, n] : edges) ASSERT_TRUE(n == 1 && edges.contains({edge.second, edge.first}));
    constexpr double kChords = .05;  // polygons of a voxel cut the ball's surface
    EXPECT_NEAR(volume[0], ballVolume(1), kChords * ballVolume(1));
    EXPECT_NEAR(volume[1], ballVolume(.5), kChords * ballVolume(.5));
}

TEST(LevelSetSurface, AdaptivityJoinsPolygons)
{
    const auto phi = grid::wrap(ball(3, {0, 0, 0}));
    EXPECT_LT(2 * grid::surfaceOf(phi, .8).triangles.size(), grid::surfaceOf(phi, 0).triangles.size());
}
