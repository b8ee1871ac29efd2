// Where what moves by keys is, and how fast.
#include <vdbfrac/scene/placement.h>

#include <gtest/gtest.h>

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
    const Keys keys = tumbling();
    const Vec3 X(1.3, .4, -.6);
    for (double t : {.1 + kStep, .23, .37, .5 - kStep, .5 + kStep, .64, .79}) {
        const Vec3 difference = (placementAt(keys, t + kStep)(X) - placementAt(keys, t - kStep)(X)) / (2 * kStep);
        EXPECT_LT((velocityAt(keys, t)(placementAt(keys, t)(X)) - difference).norm(), kSmall * difference.norm()) << t;
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
