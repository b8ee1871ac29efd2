// What is drawn of bodies that touch colliders: on their surface, not inside.
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/point_cache.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/placement.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;

namespace {

constexpr double kDx = .05;  // m
constexpr double kExact = 1e-12;

constexpr double kRise = .1;  // m/s
/// A floor that rises, so soft that things sink in, and a ball that moves and turns.
constexpr const char* kColliders =
    "[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\nstiffness = 0.3\n"
    "move = { velocity = [0, 0.1, 0] }\n"
    "[[collider]]\nname = \"moving\"\nshape = { sphere = { radius = 0.5, center = [2, 2, 0] } }\n"
    "move = { keys = [{ time = 0 }, { time = 1, translate = [0.4, 0, 0.2], rotate = [0, 0, 90] }], "
    "pivot = [2.3, 2, 0] }\n";

/// A soft ball that falls on the floor. `more`: of [output].
std::string fallingBall(const std::string& colliders, const std::string& more = "")
{
    return "version = 1\nname = \"fall\"\ntime = { frames = [1, 8], fps = 24 }\ngrid = { voxel_size = 0.05 }\n"
           "[[body]]\nname = \"ball\"\nshape = { sphere = { radius = 0.3, center = [0, 0.32, 0] } }\n"
           "velocity = [0, -2, 0]\nmaterial = \"jelly\"\n"
           "[material.jelly]\nyoungs_modulus = 3e4\npoisson_ratio = 0.4\ndensity = 1000\n" +
           colliders + "[output]\nvdb = []\nmotion = true\n" + more;
}

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
    double deepest = 0;
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
    }
    EXPECT_GT(deepest, kDeep);
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
        std::vector<Vec3> point{Vec3(center(kTime) + r * way)}, velocity{Vec3(1, 2, 3)};
        const Vec3 at = point[0];
        EXPECT_EQ(stages[0]->place(kTime, point, velocity), depth > 0 && depth < 4) << depth;
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
