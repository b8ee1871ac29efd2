// What is drawn of bodies that touch colliders: on their surface, not inside.
#include "drawn_surface.h"

#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/point_cache.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/placement.h>
#include <vdbfrac/solids/solid_mesh.h>
#include <vdbfrac/tetmesh/surface_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;
using test::Drawn;
using test::fallingBall;
using test::kDx;

namespace {

constexpr double kExact = 1e-12;

constexpr double kRise = .1;  // m/s
/// A floor that rises, so soft that things sink in, and a ball that moves and turns.
constexpr const char* kColliders =
    "[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\nstiffness = 0.3\n"
    "move = { velocity = [0, 0.1, 0] }\n"
    "[[collider]]\nname = \"moving\"\nshape = { sphere = { radius = 0.5, center = [2, 2, 0] } }\n"
    "move = { keys = [{ time = 0 }, { time = 1, translate = [0.4, 0, 0.2], rotate = [0, 0, 90] }], "
    "pivot = [2.3, 2, 0] }\n";

double lowest(const core::DrawnFrame& frame)
{
    double least = 1;
    for (const Vec3& p : frame[0].points) least = std::min(least, p.y());
    return least;
}

TEST(DrawnContact, IsMovedOutOfCollidersAndTheStateIsNot)
{
    constexpr double kDeep = .8;  // voxels, at least: what is simulated
    SceneRun seen(fallingBall(kColliders)), raw(fallingBall(kColliders, "in_colliders = \"as_simulated\"\n"));
    core::Drawing drawing(seen.scene, seen.simulation), asSimulated(raw.scene, raw.simulation);
    double deepest = 0, squeeze = 1;
    std::size_t moved = 0;
    for (int frame = 2; frame <= seen.scene.time.lastFrame; ++frame) {
        seen.toFrame(frame), raw.toFrame(frame);
        ASSERT_EQ(seen.simulation.stateHash(), raw.simulation.stateHash());
        drawing.follow(seen.simulation, seen.work), asSimulated.follow(raw.simulation, raw.work);
        const core::DrawnFrame drawn = drawing.frame(seen.simulation), all = asSimulated.frame(raw.simulation);
        const double floor = kRise * seen.simulation.time();
        EXPECT_GE(lowest(drawn), floor - kExact);
        deepest = std::max(deepest, (floor - lowest(all)) / kDx);
        std::int64_t own = 0;
        for (std::size_t i = 0; i < drawn[0].points.size(); ++i) {
            const Vec3 &was = all[0].points[i], &is = drawn[0].points[i];
            const bool isIn = was.y() < floor;
            EXPECT_LT((is - (isIn ? Vec3(was.x(), floor, was.z()) : was)).norm(), isIn * kExact + 1e-300);
            const Vec3 &flew = all[0].velocity[i], &flies = drawn[0].velocity[i];
            EXPECT_LT((flies - (isIn ? Vec3(flew.x(), kRise, flew.z()) : flew)).norm(), isIn * kExact + 1e-300);
            moved += isIn, own += isIn;
        }
        EXPECT_EQ(drawn[0].moved, own);
        EXPECT_EQ(all[0].moved, 0);
        // What the material bears is not what the picture hides.
        EXPECT_EQ(core::squeezeOf(drawn), core::squeezeOf(all));
        squeeze = std::min(squeeze, core::squeezeOf(drawn));
    }
    EXPECT_GT(deepest, kDeep);
    EXPECT_LT(squeeze, .99);
    EXPECT_GT(moved, 100u);
}

/// Straight out; all the way down to a depth of two voxels, then less, not at all at four, and never past what was less
/// deep. Along with the collider.
TEST(DrawnContact, LiesOnWhatMoves)
{
    constexpr double kTime = .25, kStep = 1e-6;  // s
    SceneRun run(fallingBall(kColliders));
    const auto& stages = run.simulation.stages().draw;
    ASSERT_EQ(stages.size(), 1u);
    const scene::Collider& ball = run.scene.colliders[1];
    const auto center = [&](double time) { return scene::placementAt(ball.move, time)(Vec3(2, 2, 0)); };
    const Vec3 way = Vec3(.6, .64, -.48);  // of length 1
    double before = -1;
    for (double depth = -.45; depth < 6; depth += .1) {
        const double r = .5 - depth * kDx;
        Drawn drawn(std::vector<Vec3>{Vec3(center(kTime) + r * way)});
        drawn.velocity[0] = Vec3(1, 2, 3);
        const Vec3 at = drawn.points[0];
        const std::vector<Vec3>&point = drawn.points, &velocity = drawn.velocity;
        drawn.place(run, kTime);
        EXPECT_EQ(drawn.isMoved[0], depth > 0 && depth < 4) << depth;
        EXPECT_LT((point[0] - at).cross(way).norm(), kExact) << depth;
        const double is = (.5 - (point[0] - center(kTime)).norm()) / kDx;
        if (depth <= 0 || depth >= 4) {
            EXPECT_EQ(point[0], at) << depth;
            EXPECT_EQ(velocity[0], Vec3(1, 2, 3)) << depth;
        } else if (depth <= 2) {
            EXPECT_NEAR(is, 0, 1e-9) << depth;
            // As fast outward as the surface there.
            const auto surface = [&](double time) {
                return scene::placementAt(ball.move, time)(scene::placementAt(ball.move, kTime).inverse(at));
            };
            const Vec3 carried = (surface(kTime + kStep) - surface(kTime - kStep)) / (2 * kStep);
            EXPECT_NEAR(velocity[0].dot(way), carried.dot(way), 1e-6) << depth;
            EXPECT_LT((velocity[0] - Vec3(1, 2, 3)).cross(way).norm(), kExact) << depth;
        }
        EXPECT_GE(is, std::min(before, depth) - 1e-9) << depth;
        before = std::max(is, before);
    }
}

/// Where points are drawn at the start.
std::vector<Vec3> movedOut(const SceneRun& run, std::vector<Vec3> points)
{
    Drawn drawn(std::move(points));
    drawn.place(run, 0);
    return drawn.points;
}

/// The way out of one collider may lead into the next: what is in a groove ends on both of its sides.
TEST(DrawnContact, LiesInAGroove)
{
    constexpr double kTouching = 1e-6;  // voxels
    // Sides that rise by 60 degrees from the z axis.
    const SceneRun run(
        fallingBall("[[collider]]\nshape = { halfspace = { normal = [0.8660254037844386, -0.5, 0] } }\n"
                    "[[collider]]\nshape = { halfspace = { normal = [-0.8660254037844386, -0.5, 0] } }\n"));
    std::vector<Vec3> points;
    for (double x = -1; x <= 1; x += .1)
        for (double y = -1; y <= 2; y += .1) points.push_back(kDx * Vec3(x, y, 0));
    std::size_t inBoth = 0;
    for (const Vec3& p : movedOut(run, points))
        for (double side : {1., -1.}) {
            const double depth = (side * .8660254037844386 * p.x() - .5 * p.y()) / kDx;
            EXPECT_LT(depth, kTouching) << p.transpose() / kDx;
            inBoth += depth > -kTouching;
        }
    EXPECT_GT(inBoth, points.size() / 2);  // all that are below both lie where they meet
    // What is deep in one stays as deep as it would without the other.
    for (const double depth : {2.5, 3., 3.5}) {
        const Vec3 out(-.8660254037844386, .5, 0), along(.5, .8660254037844386, 0);
        const auto depthAt = [&](double up) {
            return -movedOut(run, {kDx * (up * along - depth * out)})[0].dot(out) / kDx;
        };
        EXPECT_NEAR(depthAt(9), depth * (1 - (4 - depth) / 2), 1e-9);
        EXPECT_GT(depthAt(.7), .9 * depthAt(9)) << depth;
    }
}

/// What comes near to the middle of something thin stays there: beyond it the way out is another.
TEST(DrawnContact, IsNotThrownThroughWhatIsThin)
{
    constexpr double kHalf = 1;  // voxels
    const SceneRun run(fallingBall("[[collider]]\nshape = { box = { size = [5, 0.1, 5], center = [0, -1, 0] } }\n"));
    std::vector<Vec3> points;
    for (double y = -1.5; y <= 1.5; y += .01) points.push_back(Vec3(.01, kDx * y - 1, .02));
    const std::vector<Vec3> are = movedOut(run, points);
    for (std::size_t i = 0; i < are.size(); ++i) {
        const double was = (points[i].y() + 1) / kDx, is = (are[i].y() + 1) / kDx;
        EXPECT_LE(std::abs(is), std::max(std::abs(was), kHalf + 1e-9)) << was;
        EXPECT_GE(std::abs(is), std::min(std::abs(was), kHalf)) << was;
        if (i == 0) continue;
        EXPECT_GE(is, (are[i - 1].y() + 1) / kDx - 1e-9) << was;
        EXPECT_LT(is - (are[i - 1].y() + 1) / kDx, .035) << was;  // three times as far as before, at most
    }
    EXPECT_NEAR(are[80].y(), -1 - kDx, 1e-9);  // .3 voxels deep
}

/// Distances round a surface from a file are told between voxels, not exactly.
TEST(DrawnContact, LiesOnASurfaceFromAFile)
{
    constexpr double kTouching = 1e-6;  // voxels
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("vdbfrac_drawn_contact_" + std::to_string(::getpid()) + ".obj");
    const auto ball = solids::solidMesh({.kind = Primitive::Kind::sphere, .radius = .4}, {}, .08);
    ASSERT_TRUE(ball);
    tetmesh::writeSurface(file, test::surfaceOf(*ball, 0));
    const SceneRun run(
        fallingBall("[[collider]]\nshape = { mesh = { file = \"" + file.string() + "\", translate = [0, -1, 0] } }\n"));
    std::vector<Vec3> points;
    for (int i = 0; i < 300; ++i) {
        const Vec3 way = Vec3(std::sin(i), std::cos(1.3 * i), std::sin(2.1 * i + 1)).normalized();
        points.push_back(Vec3(0, -1, 0) + (.38 - .06 * (i % 2)) * way);
    }
    const std::vector<Vec3> once = movedOut(run, points), twice = movedOut(run, once);
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_LT((twice[i] - once[i]).norm() / kDx, kTouching) << i;
        EXPECT_NEAR((once[i] - Vec3(0, -1, 0)).norm(), .4, .1 * kDx) << i;
    }
    std::filesystem::remove(file);
}

TEST(DrawnContact, IsTheSameInAPointCache)
{
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("vdbfrac_drawn_contact_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    SceneRun run(fallingBall(kColliders));
    core::Drawing drawing(run.scene, run.simulation);
    std::vector<std::filesystem::path> motion;
    std::vector<core::DrawnFrame> frames;
    for (int frame = 1; frame <= run.scene.time.lastFrame; ++frame) {
        run.toFrame(frame);
        motion.push_back(folder / std::to_string(frame));
        core::motionOf(run.simulation).write(motion.back());
        drawing.follow(run.simulation, run.work);
        frames.push_back(drawing.frame(run.simulation));
    }
    drawing.followWhole(run.simulation, run.work);
    const core::PointCache cache(run.scene, run.simulation, drawing, motion);
    for (std::size_t f = 0; f < frames.size(); ++f) {
        const core::DrawnFrame cached = cache.frame(f);
        ASSERT_EQ(cached[0].points.size(), frames[f][0].points.size());
        double off = 0;
        for (std::size_t i = 0; i < cached[0].points.size(); ++i)
            off = std::max({off, (cached[0].points[i] - frames[f][0].points[i]).norm(),
                            (cached[0].velocity[i] - frames[f][0].velocity[i]).norm()});
        EXPECT_LT(off, kExact) << f;
    }
    std::filesystem::remove_all(folder);
}

/// Nothing is asked of where there is no collider, or the scene does not want it.
TEST(DrawnContact, JoinsOnlyWhereItIsWanted)
{
    EXPECT_TRUE(
        SceneRun(fallingBall(kColliders, "in_colliders = \"as_simulated\"\n")).simulation.stages().draw.empty());
    EXPECT_TRUE(SceneRun(fallingBall("")).simulation.stages().draw.empty());
}

}  // namespace
