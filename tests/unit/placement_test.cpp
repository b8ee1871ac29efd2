// Where what moves by keys is, and how fast.
#include <vdbfrac/scene/placement.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace vdbfrac;
using namespace vdbfrac::scene;

namespace {

Keys tumbling()
{
    return {{{.1, {0, 0, 0}, {0, 0, 0}}, {.5, {1, 2, -1}, {200, -70, 130}}, {.8, {1, 0, 3}, {-50, 90, 500}}},
            {.3, -.2, .5}};
}

}  // namespace

TEST(Placement, VelocityIsTheDerivativeOfTheWay)
{
    constexpr double kStep = 1e-5, kSmall = 1e-6;  // s; of the largest speed, by differences of second order
    const Vec3 X(1.3, .4, -.6);
    for (const bool isSmooth : {false, true}) {
        Keys keys = tumbling();
        keys.isSmooth = isSmooth;
        for (double t : {.1 + 2 * kStep, .23, .37, .5 - kStep, .5 + kStep, .64, .79}) {
            const Vec3 difference = (placementAt(keys, t + kStep)(X) - placementAt(keys, t - kStep)(X)) / (2 * kStep);
            EXPECT_LT((velocityAt(keys, t)(placementAt(keys, t)(X)) - difference).norm(),
                      kSmall * std::max(1., difference.norm()))
                << t;
        }
    }
    const Path path = Velocity{{1, 2, 3}};
    EXPECT_EQ(velocityAt(path, 7)(X), Vec3(1, 2, 3));
}

TEST(Placement, WhatIsBeforeAndAfterItsKeysStandsStill)
{
    const Keys keys = tumbling();
    for (double t : {0., .09, .8, 2.}) EXPECT_EQ(velocityAt(keys, t)(Vec3(1, 1, 1)), Vec3(0, 0, 0)) << t;
    EXPECT_NE(velocityAt(keys, .1)(Vec3(1, 1, 1)), Vec3(0, 0, 0));  // just after
}

/// Two keys are half a wave, nearly: at rest at both ends, and fastest, by half as much again, in the middle.
TEST(Placement, SmoothKeysStartAndEndAtRest)
{
    const Keys keys{.keys = {{1, {0, 0, 0}}, {3, {4, 0, 0}}}, .isSmooth = true};
    const auto x = [&](double t) { return placementAt(keys, t)(Vec3::Zero()).x(); };
    const auto v = [&](double t) { return velocityAt(keys, t)(Vec3::Zero()).x(); };
    EXPECT_EQ(v(1), 0);
    EXPECT_NEAR(v(2), 1.5 * 2, 1e-12);
    EXPECT_NEAR(v(2.999999), 0, 1e-5);
    EXPECT_NEAR(x(1.5), 4 * .25 * .25 * (3 - .5), 1e-12);
    EXPECT_EQ(x(3), 4);
}

TEST(Placement, SmoothKeysGoThroughKeysWithoutAJumpAndNeverPastThem)
{
    constexpr double kStep = 1e-9;  // s
    const Keys keys{.keys = {{0, {0, 0, 5}}, {.2, {1, 0, 5}}, {1, {2, 3, 5}}, {1.1, {2, -1, 5}}, {3, {9, -1, 5}}},
                    .isSmooth = true};
    const auto at = [&](double t) { return placementAt(keys, t)(Vec3::Zero()); };
    const auto v = [&](double t) { return velocityAt(keys, t)(Vec3::Zero()); };
    for (const PoseKey& k : keys.keys) {
        EXPECT_LT((at(k.time) - k.translate).norm(), 1e-12) << k.time;
        EXPECT_LT((v(k.time) - v(k.time - kStep)).norm(), 1e-5) << k.time;
    }
    EXPECT_GT(v(.2).x(), 0);  // goes on
    EXPECT_EQ(v(1).x(), 0);   // stands between two equal keys
    EXPECT_EQ(v(1).y(), 0);   // turns back
    for (std::size_t k = 0; k + 1 < keys.keys.size(); ++k)
        for (double s = 0; s < 1; s += .01) {
            const PoseKey &a = keys.keys[k], &b = keys.keys[k + 1];
            const Vec3 x = at((1 - s) * a.time + s * b.time);
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GE(x[axis], std::min(a.translate[axis], b.translate[axis]) - 1e-12);
                EXPECT_LE(x[axis], std::max(a.translate[axis], b.translate[axis]) + 1e-12);
            }
        }
}
