// The material against closed forms and finite differences.
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

using namespace vdbfrac;
using lab::kGel;
using lab::randomVec;
using solver::Volumetric;

namespace {

TEST(Corotational, RigidTurnGivesNoStress)
{
    const lab::Block mesh({3, 3, 3}, 1);
    const auto elastic = lab::elasticOperator(mesh, kGel, Volumetric::none);
    std::mt19937 random(3);
    for (int trial = 0; trial < 50; ++trial) {
        const Mat3 R =
            Eigen::Quaterniond(Eigen::Vector4d(randomVec(random, 1).homogeneous())).normalized().toRotationMatrix();
        std::vector<Vec3> x, gradient(mesh.nodes.size(), Vec3::Zero());
        for (const Vec3& X : mesh.restPositions()) x.push_back(R * X);
        elastic.evaluate(x, gradient, nullptr);
        // Forces on unit faces: a stress of 1e-14 E, some 24 tets a node.
        for (const Vec3& f : gradient) EXPECT_LT(f.norm(), 24 * 1e-14 * 1e5);
    }
}

TEST(Corotational, SimpleShearMatchesClosedForm)
{
    const solver::Material m = solver::makeMaterial(1, 0.3, 1);
    const double expected[4][2] = {{.1, 1.0031192}, {.5, 1.0746437}, {1, 1.2639320}, {2, 1.7322330}};
    for (const auto& [g, ratio] : expected) {
        Mat3 F = Mat3::Identity();
        F(0, 1) = g;
        EXPECT_NEAR(solver::piolaStress(F, m)(0, 1) / (m.mu * g), ratio, 1e-7);
    }
}

TEST(Corotational, UniaxialConfinedAndHydrostaticStress)
{
    const double E = 1e5, nu = 0.3;
    for (double e : {-0.3, 0.2, 1.5}) {
        const Mat3 uniaxial = Vec3(1 + e, 1 - nu * e, 1 - nu * e).asDiagonal();
        EXPECT_NEAR(solver::piolaStress(uniaxial, kGel)(0, 0), E * e, 1e-9 * E);
        EXPECT_NEAR(solver::energyDensity(uniaxial, kGel), 0.5 * E * e * e, 1e-9 * E);
        const Mat3 confined = Vec3(1 + e, 1, 1).asDiagonal();
        EXPECT_NEAR(solver::piolaStress(confined, kGel)(0, 0), (kGel.lambda + 2 * kGel.mu) * e, 1e-9 * E);
        const double K = E / (3 * (1 - 2 * nu));
        EXPECT_NEAR(solver::piolaStress(Mat3::Identity() * (1 + e), kGel)(0, 0), 3 * K * e, 1e-9 * E);
        EXPECT_NEAR(solver::energyDensity(Mat3::Identity() * (1 + e), kGel), 4.5 * K * e * e, 1e-9 * E);
    }
}

TEST(Corotational, TwistEigenvaluesMatchReference)
{
    const solver::Material m = solver::makeMaterial(1, 0.3, 1);
    const auto sorted = [&](const Mat3& F) {
        Vec3 v = solver::twistEigenvalues(F, m) / m.mu;
        std::sort(v.data(), v.data() + 3);
        return v;
    };
    EXPECT_LT((sorted(Mat3::Identity() * .9) - Vec3::Constant(-.722222)).norm(), 2e-6);
    EXPECT_LT((sorted(Vec3(1.3, .85, .85).asDiagonal()) - Vec3(-.352941, .139535, .139535)).norm(), 2e-6);
    EXPECT_LT((sorted(Vec3(1, .5, -.2).asDiagonal()) - Vec3(-28.3333, -9.375, -4.06667)).norm(), 1e-4);
}

TEST(Corotational, StressDifferentialIsDerivativeOfStress)
{
    std::mt19937 random(9);
    for (int trial = 0; trial < 20; ++trial) {
        Mat3 F = Mat3::Identity(), dF;
        for (int c = 0; c < 3; ++c) F.col(c) += randomVec(random, 0.3), dF.col(c) = randomVec(random, 1);
        const double step = 1e-6;
        const Mat3 expected =
            (solver::piolaStress(F + step * dF, kGel) - solver::piolaStress(F - step * dF, kGel)) / (2 * step);
        EXPECT_LT((solver::stressDifferential(F, dF, kGel) - expected).norm(), 1e-7 * expected.norm());
    }
}

}  // namespace
