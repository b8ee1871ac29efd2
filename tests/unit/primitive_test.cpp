// Analytic solids.
#include <vdbfrac/base/primitive.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace vdbfrac;

namespace {

struct Solid {
    const char* name;
    Primitive primitive;
};

std::vector<Solid> solids()
{
    const Vec3 center(.2, -.3, .5), axis = Vec3(1, 2, -.5).normalized();
    std::vector<Solid> all;
    const auto add = [&](const char* name, Primitive::Kind kind) -> Primitive& {
        all.push_back({name, {}});
        all.back().primitive.kind = kind;
        all.back().primitive.center = center;
        return all.back().primitive;
    };
    add("box", Primitive::Kind::box).size = Vec3(1, .6, .4);
    Primitive& turned = add("turned box", Primitive::Kind::box);
    turned.size = Vec3(1, .6, .4), turned.rotate = Vec3(20, -35, 70);
    add("sphere", Primitive::Kind::sphere).radius = .7;
    for (const char* name : {"cylinder", "endless cylinder"}) {
        Primitive& p = add(name, Primitive::Kind::cylinder);
        p.axis = axis, p.radius = .4, p.height = std::string(name) == "cylinder" ? 1.1 : 0;
    }
    Primitive& capsule = add("capsule", Primitive::Kind::capsule);
    capsule.axis = axis, capsule.radius = .3, capsule.height = .9;
    Primitive& torus = add("torus", Primitive::Kind::torus);
    torus.axis = axis, torus.radius = .7, torus.tube = .2;
    Primitive& half = add("halfspace", Primitive::Kind::halfspace);
    half.axis = axis, half.offset = .25;
    return all;
}

Vec3 gradientOf(const Primitive& solid, const Vec3& X)
{
    constexpr double kStep = 1e-6;
    Vec3 g;
    for (int d = 0; d < 3; ++d)
        g[d] = (signedDistance(solid, X + kStep * Vec3::Unit(d)) - signedDistance(solid, X - kStep * Vec3::Unit(d))) /
               (2 * kStep);
    return g;
}

Vec3 somewhere(std::mt19937& random)
{
    std::uniform_real_distribution<double> uniform(-1.6, 1.6);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(.2, -.3, .5) + Vec3(x, y, z);
}

TEST(Primitives, DistanceIsTheLengthToTheNearestPointOfTheSurface)
{
    constexpr double kDifference = 1e-5;  // central differences with a step of 1e-6 where the surface bends
    for (const Solid& s : solids()) {
        std::mt19937 random(2);
        for (int trial = 0; trial < 2000; ++trial) {
            const Vec3 X = somewhere(random);
            const double distance = signedDistance(s.primitive, X);
            const Vec3 g = gradientOf(s.primitive, X);
            ASSERT_NEAR(g.norm(), 1, kDifference) << s.name;
            ASSERT_LT((distanceGradient(s.primitive, X) - g).norm(), kDifference) << s.name;
            ASSERT_NEAR(signedDistance(s.primitive, X - distance * g), 0, kDifference) << s.name;
        }
    }
}

TEST(Primitives, BoundsHoldTheSurfaceAndTouchIt)
{
    constexpr double kDifference = 1e-5;
    constexpr double kSampling = .03;  // m: 20000 random points come that near to every extreme
    for (const Solid& s : solids()) {
        const Bounds b = bounds(s.primitive);
        Vec3 lower = Vec3::Constant(1e9), upper = Vec3::Constant(-1e9);
        std::mt19937 random(3);
        for (int trial = 0; trial < 20000; ++trial) {
            const Vec3 X = somewhere(random);
            const Vec3 onSurface = X - signedDistance(s.primitive, X) * gradientOf(s.primitive, X);
            lower = lower.cwiseMin(onSurface);
            upper = upper.cwiseMax(onSurface);
        }
        for (int d = 0; d < 3; ++d) {
            EXPECT_GE(lower[d], b.lower[d] - kDifference) << s.name;
            EXPECT_LE(upper[d], b.upper[d] + kDifference) << s.name;
            if (std::isfinite(b.lower[d])) {
                EXPECT_LE(lower[d], b.lower[d] + kSampling) << s.name << d;
            }
            if (std::isfinite(b.upper[d])) {
                EXPECT_GE(upper[d], b.upper[d] - kSampling) << s.name << d;
            }
        }
        const bool endless = std::string(s.name) == "halfspace" || std::string(s.name) == "endless cylinder";
        EXPECT_EQ(b.lower.allFinite() && b.upper.allFinite(), !endless) << s.name;
    }
}

TEST(Primitives, KnownDistances)
{
    Primitive box;
    box.size = Vec3(2, 2, 2);
    EXPECT_DOUBLE_EQ(signedDistance(box, Vec3(2, 2, 2)), std::sqrt(3.));
    EXPECT_DOUBLE_EQ(signedDistance(box, Vec3::Zero()), -1);
    box.size = Vec3(2, 1, 1), box.rotate = Vec3(0, 0, 90);  // along y now
    EXPECT_NEAR(signedDistance(box, Vec3(0, 2, 0)), 1, 1e-15);
    EXPECT_NEAR(signedDistance(box, Vec3(2, 0, 0)), 1.5, 1e-15);
    Primitive half;
    half.kind = Primitive::Kind::halfspace;
    half.axis = Vec3::UnitZ();
    half.offset = 2;
    EXPECT_DOUBLE_EQ(signedDistance(half, Vec3(5, 5, 3)), -1);  // all X with normal.X >= offset
    Primitive torus;
    torus.kind = Primitive::Kind::torus;
    torus.axis = Vec3::UnitZ();
    torus.radius = 2, torus.tube = .5;
    EXPECT_DOUBLE_EQ(signedDistance(torus, Vec3::Zero()), 1.5);
    EXPECT_DOUBLE_EQ(signedDistance(torus, Vec3(0, 2, 0)), -.5);
}

}  // namespace
