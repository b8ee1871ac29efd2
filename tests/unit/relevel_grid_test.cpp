// Grids with a surface at their zero -> clean level sets: what is kept, what is mended.
#include "openvdb_access.h"
#include "settle_signs.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <openvdb/tools/LevelSetSphere.h>

#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <ostream>
#include <tuple>

using namespace vdbfrac;
using namespace vdbfrac::grid;
using Grid = openvdb::FloatGrid;
namespace fs = std::filesystem;

namespace {

constexpr float kDx = 0.05f;
constexpr float kRadius = 10 * kDx;  // R / dx = 10: the coarsest ball that has to hold
// Off the voxels' centers, by another part of a voxel on each axis.
const openvdb::Vec3f kCenter(0.013f, -0.02f, 0.031f);
// Relative, after 100 times; of larger balls less, since sweeps err by second order.
constexpr double kVolumeHeld = 2e-4;
// Rms of |grad phi| - 1 within one voxel; 1e-3 are the differences' own at R = 10 dx.
constexpr double kSlopeHeld = 3e-3;
// A cubic through four voxels: (dx / R)^3 times a small constant, of the distance.
constexpr double kSampled = 0.01;      // voxels
constexpr double kVolume = 0.01;       // relative; of levelSetVolume's own smeared surface at R = 10 dx
constexpr double kRebuiltBand = 0.05;  // voxels, in the whole band: first-order sweeps, polished

struct Ball {
    float radius = kRadius;  // [m]
    openvdb::Vec3f center = kCenter;
};

Grid::Ptr ball(const Ball& b = {}, float halfWidth = 3)
{
    return openvdb::tools::createLevelSetSphere<Grid>(b.radius, b.center, kDx, halfWidth);
}

double exactAt(const Grid& grid, const openvdb::Coord& c, const Ball& b = {})
{
    return (grid.indexToWorld(c) - openvdb::Vec3d(b.center)).length() - double(b.radius);
}

/// Largest error [voxels] of a level set of the ball where it is nearer to its surface than `within` voxels.
double worstError(const LevelSet& phi, double within, const Ball& b = {})
{
    const Grid& grid = *phi.grid().grid;
    double worst = 0;
    for (auto v = grid.cbeginValueOn(); v; ++v)
        if (std::abs(*v) < within * phi.voxelSize())
            worst = std::max(worst, std::abs(*v - exactAt(grid, v.getCoord(), b)) / phi.voxelSize());
    return worst;
}

/// Active exactly where |phi| is below the background, everywhere.
void expectBand(const LevelSet& phi, double halfWidth, const Ball& b = {})
{
    const Grid& grid = *phi.grid().grid;
    EXPECT_EQ(grid.getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_NEAR(grid.background(), halfWidth * phi.voxelSize(), 1e-6 * grid.background());
    std::size_t wrong = 0, inBand = 0;
    for (auto v = grid.cbeginValueAll(); v; ++v)
        wrong += v.isValueOn() != (std::abs(*v) < grid.background()) || std::abs(*v) > grid.background();
    EXPECT_EQ(wrong, 0u);
    const double outer = halfWidth * phi.voxelSize() - 0.1 * phi.voxelSize();
    const auto values = grid.getConstAccessor();
    for (auto ijk = grid.evalActiveVoxelBoundingBox().begin(); ijk; ++ijk)
        if (std::abs(exactAt(grid, *ijk, b)) < outer) inBand += !values.isValueOn(*ijk);
    EXPECT_EQ(inBand, 0u) << "voxels of the band that are not active";
}

/// phi = f(distance) on the voxels of the ball's band, and on all within `reach` voxels.
template <class F>
LevelSet disguised(const F& f, float reach)
{
    Grid::Ptr grid = ball({}, reach);
    for (auto v = grid->beginValueOn(); v; ++v)
        v.setValue(float(f(exactAt(*grid, v.getCoord()), grid->indexToWorld(v.getCoord()))));
    return grid::wrap(grid);
}

class RelevelFile : public testing::Test {
protected:
    void SetUp() override
    {
        folder_ = fs::temp_directory_path() / ("vdbfrac-" + std::to_string(::getpid()) + "-" +
                                               testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path write(const Grid::Ptr& grid) const
    {
        const LevelSet phi = grid::wrap(grid);
        writeVdb(folder_ / "g.vdb", {{"g", &phi, {}, 1, ""}}, {});
        return folder_ / "g.vdb";
    }
    fs::path folder_;
};

struct Repeated {
    int radius;  // voxels
    int times;
};
void PrintTo(const Repeated& r, std::ostream* out) { *out << r.radius << " voxels, " << r.times << " times"; }

class RelevelledBall : public testing::TestWithParam<std::tuple<Repeated, openvdb::Vec3f>> {};

TEST_P(RelevelledBall, IsHeld)
{
    const auto [repeated, center] = GetParam();
    const Ball exact{float(repeated.radius) * kDx, center};
    LevelSet phi = grid::wrap(ball(exact));
    const LevelSetReport start = measure(phi);
    for (int i = 0; i < repeated.times; ++i) {
        Relevelled again = relevel(phi, {});
        ASSERT_EQ(again.redistancing, Redistancing::track);
        phi = std::move(again.levelSet);
    }
    const LevelSetReport end = measure(phi);
    std::printf("volume %+.1e, rms of the slope %.4f (start %.4f), error in the band %.3f voxels\n",
                end.volume / start.volume - 1, end.beside.rms, start.beside.rms, worstError(phi, 3, exact));
    EXPECT_LE(std::abs(end.volume / start.volume - 1),
              kVolumeHeld * repeated.times / 100 * std::pow(10. / repeated.radius, 2));
    EXPECT_LE(end.beside.rms, kSlopeHeld);
    EXPECT_LE(worstError(phi, 3, exact), kRebuiltBand);
    expectBand(phi, 3, exact);
}

std::string nameOf(const testing::TestParamInfo<RelevelledBall::ParamType>& test)
{
    const auto& [repeated, center] = test.param;
    return std::to_string(repeated.radius) + "Voxels" + std::to_string(repeated.times) + "Times" +
           (center == kCenter ? "OffTheLattice" : "OnTheLattice");
}

// A hundred times would take the largest ball more than a minute.
INSTANTIATE_TEST_SUITE_P(RadiiAndCenters, RelevelledBall,
                         testing::Combine(testing::Values(Repeated{10, 100}, Repeated{20, 100}, Repeated{40, 10}),
                                          testing::Values(openvdb::Vec3f(0), kCenter)),
                         nameOf);

TEST(RelevelGrid, TheSweptBallIsADistanceAndHoldsToo)
{
    // Half as steep as a distance on one side, and 2.5 times on the other.
    const LevelSet source = disguised([](double d, const openvdb::Vec3d& x) { return d * (1.5 + x.x() / kRadius); }, 4);
    Relevelled once = relevel(source, {});
    EXPECT_EQ(once.redistancing, Redistancing::sweep);
    EXPECT_GT(once.before.beside.rms, 0.25);
    EXPECT_LE(once.after.beside.rms, 2 * kSlopeHeld);
    EXPECT_LE(worstError(once.levelSet, 1), kSampled);
    expectBand(once.levelSet, 3);
    const double volume = once.after.volume;
    EXPECT_NEAR(volume / measure(grid::wrap(ball())).volume, 1, 2e-3);
    for (int i = 0; i < 10; ++i) once = relevel(once.levelSet, {});
    EXPECT_EQ(once.redistancing, Redistancing::track);
    EXPECT_NEAR(once.after.volume / volume, 1, kVolumeHeld);
}

/// Constants of OpenVDB's sweeps weigh nothing in voxels of .03 mm either: a power of two changes no bit.
TEST(RelevelGrid, BallsOfAnySizeBecomeTheSame)
{
    const auto relevelled = [](float size) {
        const float dx = 0x1p-7f * size;
        Relevelled r =
            relevel(grid::wrap(openvdb::tools::createLevelSetSphere<Grid>(10 * dx, size * 0.3f * kCenter, dx, 3)), {});
        EXPECT_EQ(r.redistancing, Redistancing::track);
        return r;
    };
    const Relevelled large = relevelled(1), small = relevelled(0x1p-8f);
    EXPECT_LE(small.after.beside.rms, kSlopeHeld);
    EXPECT_EQ(small.after.volume, 0x1p-24 * large.after.volume);
    const Grid &a = *large.levelSet.grid().grid, &b = *small.levelSet.grid().grid;
    ASSERT_EQ(a.activeVoxelCount(), b.activeVoxelCount());
    for (auto v = a.cbeginValueOn(); v; ++v) ASSERT_EQ(b.tree().getValue(v.getCoord()), 0x1p-8f * *v);
}

TEST(RelevelGrid, SmoothFunctionsGiveTheirZeroToFourthOrder)
{
    // Not a distance: |x|^2 - R^2, of gradient 2 R at the surface.
    const LevelSet source =
        disguised([](double d, const openvdb::Vec3d&) { return (d + kRadius) * (d + kRadius) - kRadius * kRadius; }, 6);
    RelevelOptions options;
    options.redistancing = Redistancing::sweep;
    const Relevelled result = relevel(source, options);
    EXPECT_LE(worstError(result.levelSet, 1), kSampled);
    EXPECT_LE(worstError(result.levelSet, 3), kRebuiltBand);
    EXPECT_LE(result.after.beside.rms, kSlopeHeld);
    expectBand(result.levelSet, 3);
}

TEST(RelevelGrid, ResamplesFinerAndCoarser)
{
    for (const double dx : {0.02, 0.05 / 1.1, 0.07, 0.16}) {
        RelevelOptions options;
        options.band.voxelSize = dx;
        options.band.halfWidth = 4;
        const Relevelled result = relevel(grid::wrap(ball()), options);
        EXPECT_TRUE(result.resampled);
        EXPECT_NEAR(result.levelSet.voxelSize(), dx, 1e-12);
        EXPECT_LE(worstError(result.levelSet, 1), kSampled * std::max(1., 0.05 / dx)) << dx;
        if (dx < 0.1) {
            EXPECT_NEAR(result.after.volume / result.before.volume, 1, kVolume) << dx;
        }
        expectBand(result.levelSet, 4);
    }
}

TEST(RelevelGrid, AcrossCountsVoxelsAlongTheLongestSide)
{
    RelevelOptions options;
    options.band.across = 40;
    const Relevelled result = relevel(grid::wrap(ball()), options);
    EXPECT_NEAR(result.levelSet.voxelSize(), 2 * kRadius / 40, 0.06 * kDx);
}

TEST(RelevelGrid, SameBitsForAnyNumberOfThreads)
{
    const LevelSet source = disguised([](double d, const openvdb::Vec3d& x) { return d * (2 + x.y()); }, 4);
    RelevelOptions options;
    options.band.voxelSize = 0.04;
    const Relevelled many = relevel(source, options);
    const ThreadLimit one(1);
    const Relevelled single = relevel(source, options);
    const auto other = single.levelSet.grid().grid->getConstAccessor();
    EXPECT_EQ(many.levelSet.activeVoxels(), single.levelSet.activeVoxels());
    EXPECT_EQ(many.after.volume, single.after.volume);
    EXPECT_EQ(many.after.beside.rms, single.after.beside.rms);
    for (auto v = many.levelSet.grid().grid->cbeginValueOn(); v; ++v) ASSERT_EQ(*v, other.getValue(v.getCoord()));
}

TEST(RelevelGrid, MemoryIsRefusedBeforeItIsTaken)
{
    RelevelOptions options;
    options.band.memoryLimit = 1000000;
    EXPECT_THROW(relevel(grid::wrap(ball()), options), LimitError);
    options.band.memoryLimit = 200000000;
    options.band.voxelSize = 1e-4;
    EXPECT_THROW(relevel(grid::wrap(ball()), options), LimitError);
}

tetmesh::PolygonSoup cube(double lower, double upper)
{
    tetmesh::PolygonSoup soup;
    for (int i = 0; i < 8; ++i)
        soup.points.emplace_back(i & 1 ? upper : lower, i >> 1 & 1 ? upper : lower, i >> 2 ? upper : lower);
    soup.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    return soup;
}

double volumeOf(const tetmesh::PolygonSoup& soup, double inset)
{
    Band band;
    band.voxelSize = 1. / 40;
    return measure(surfaceLevelSet({soup, tetmesh::examine(soup), inset, "test"}, band)).volume;
}

TEST(SurfaceLevelSet, InsetTakesAwayWhatAWrapAdds)
{
    EXPECT_NEAR(volumeOf(cube(0, 1), 0), 1, kVolume);
    EXPECT_NEAR(volumeOf(cube(-0.01, 1.01), 0.01), 1, kVolume);
    EXPECT_NEAR(volumeOf(cube(-0.1, 1.1), 0.1), 1, kVolume);
}

TEST(SurfaceLevelSet, AVoxelThatIsOutsideByMistakeLetsNoOthersOut)
{
    constexpr double kVoxel = 1. / 17.3;  // faces are nowhere near voxels
    const tetmesh::PolygonSoup soup = cube(-.5, .5);
    grid::Triangles triangles;
    for (const Vec3& X : soup.points) triangles.points.push_back(X / kVoxel);
    for (const auto& p : soup.polygons)
        for (std::size_t c = 2; c < 4; ++c)
            triangles.corners.push_back({std::uint32_t(p[0]), std::uint32_t(p[c - 1]), std::uint32_t(p[c])});
    const auto settledVolume = [&](const openvdb::Coord& planted) {
        const grid::Voxelized made = grid::voxelize(triangles, kVoxel, 3);
        if (planted.z() > 0) {
            EXPECT_LT(made.phi->tree().getValue(planted), 0);
            made.phi->tree().setValueOnly(planted, -made.phi->tree().getValue(planted));
        }
        grid::settleSigns(*made.phi, *made.closest, triangles);
        return enclosedVolume(grid::wrap(made.phi));
    };
    const double expected = settledVolume(openvdb::Coord(0));
    EXPECT_NEAR(expected, 1, kVolume);
    for (int depth = 6; depth <= 8; ++depth)  // 2.65, 1.65 and .65 voxels
        EXPECT_EQ(settledVolume(openvdb::Coord(1, -2, depth)), expected) << depth;
}

TEST(SurfaceLevelSet, ClosedHollowsAreFilled)
{
    tetmesh::PolygonSoup hollow = cube(0, 1), inner = cube(0.25, 0.75);
    for (auto polygon : inner.polygons) {
        for (std::size_t& corner : polygon) corner += 8;
        hollow.polygons.emplace_back(polygon.rbegin(), polygon.rend());
    }
    hollow.points.insert(hollow.points.end(), inner.points.begin(), inner.points.end());
    EXPECT_NEAR(volumeOf(hollow, 0), 1, kVolume);
}

TEST(SurfaceLevelSet, SheetsAndEmptySolidsAreNamed)
{
    tetmesh::PolygonSoup sheet = cube(0, 1);
    sheet.polygons.resize(1);
    EXPECT_THROW(volumeOf(sheet, 0.02), InputError);
    EXPECT_THROW(volumeOf(cube(0.005, 0.015), 0), InputError);  // between voxels
    Band fine;
    fine.across = 60000;
    fine.memoryLimit = 1000000000;
    EXPECT_THROW(surfaceLevelSet({cube(0, 1), tetmesh::examine(cube(0, 1)), 0, "test"}, fine), LimitError);
    for (const int halfWidth : {-1, 0, 1, 101}) {
        Band narrow;
        narrow.across = 8, narrow.halfWidth = halfWidth;
        EXPECT_THROW(surfaceLevelSet({cube(0, 1), tetmesh::examine(cube(0, 1)), 0, "test"}, narrow), InputError);
    }
}

TEST_F(RelevelFile, TurnedStretchedAndClasslessGridsAreRead)
{
    const Grid::Ptr turned = ball();
    turned->setGridClass(openvdb::GRID_UNKNOWN);
    const Relevelled plain = relevelFile(write(turned), "", {});
    EXPECT_LE(worstError(plain.levelSet, 1), 1e-5);
    auto transform = openvdb::math::Transform::createLinearTransform(kDx);
    transform->postRotate(0.3, openvdb::math::Z_AXIS);
    turned->setTransform(transform);
    const Relevelled rotated = relevelFile(write(turned), "g", {});
    EXPECT_TRUE(rotated.resampled);
    EXPECT_NEAR(rotated.after.volume / plain.after.volume, 1, 2e-3);
    EXPECT_LE(rotated.after.beside.rms, 2 * kSlopeHeld);
    expectBand(plain.levelSet, 3);

    Grid::Ptr stretched = Grid::create(0.2f);  // voxels of 0.05 x 0.1 x 0.05
    auto scaled = openvdb::math::Transform::createLinearTransform(kDx);
    scaled->preScale(openvdb::Vec3d(1, 2, 1));
    stretched->setTransform(scaled);
    for (auto ijk = openvdb::CoordBBox(-20, -12, -20, 20, 12, 20).begin(); ijk; ++ijk)
        stretched->tree().setValue(*ijk, float(exactAt(*stretched, *ijk)));
    const Relevelled cubes = relevelFile(write(stretched), "", {});
    EXPECT_NEAR(cubes.levelSet.voxelSize(), kDx, 1e-7);
    EXPECT_NEAR(cubes.after.volume / plain.after.volume, 1, 5e-3);
    stretched->tree().root().setBackground(0.5f * float(kDx), true);
    stretched->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_THROW(relevelFile(write(stretched), "", {}), InputError);  // nothing is known a voxel from its surface
}

TEST_F(RelevelFile, GridsWithoutASurfaceAreNamed)
{
    Grid::Ptr fog = ball();
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    EXPECT_THROW(relevelFile(write(fog), "", {}), InputError);
    Grid::Ptr outside = ball();
    for (auto v = outside->beginValueAll(); v; ++v) v.setValue(std::abs(*v) + 0.001f);
    EXPECT_THROW(relevelFile(write(outside), "", {}), InputError);
    Grid::Ptr empty = Grid::create(0.1f);
    empty->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_THROW(relevelFile(write(empty), "", {}), InputError);
    Grid::Ptr flipped = ball();
    for (auto v = flipped->beginValueAll(); v; ++v) v.setValue(-*v);
    EXPECT_THROW(relevelFile(write(flipped), "", {}), InputError);
    EXPECT_THROW(relevelFile(folder_ / "none.vdb", "", {}), FileError);
}

}  // namespace
