// Backward Euler in time against what it must keep, lose and reproduce.
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/axial_bar.h>
#include <vdbfrac/lab/samples/loads.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

using namespace vdbfrac;
using lab::AxialBar;
using lab::shaken;
using solver::Volumetric;

namespace {

solver::StepReport step(solver::State& state, double dt, const solver::ElasticOperator& elastic,
                        const solver::Boundary& boundary, const solver::NewtonSettings& settings = lab::tightSettings())
{
    return solver::stepBackwardEuler(elastic, state, dt, {{}, boundary}, settings);
}

TEST(BackwardEuler, FreeFallIsExact)
{
    constexpr double kExact = 1e-12;  // relative: rounding of some hundred steps and sums
    constexpr double g = 9.81, dt = 0.05;
    const lab::Block block({3, 2, 2}, 0.1);
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e4, .3, 1000));
    solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
    for (std::size_t i = 0; i < boundary.force.size(); ++i) boundary.force[i] = Vec3(0, 0, -g * elastic.mass()[i]);
    solver::State state = lab::atRest(block);
    for (int n = 1; n <= 40; ++n) {
        const auto report = step(state, dt, elastic, boundary);
        EXPECT_EQ(report.status, solver::StepStatus::converged)
            << n << " residual " << report.residual << " newton " << report.newtonIterations;
        const double fallen = g * dt * dt * n * (n + 1) / 2;
        for (std::size_t i = 0; i < state.x.size(); ++i) {
            const Vec3 u = state.x[i] - block.h * block.nodes[i].toVec();
            EXPECT_NEAR(-u.z(), fallen, kExact * (fallen + 1)) << n;
            EXPECT_LT(std::hypot(u.x(), u.y()), kExact * (fallen + 1));
        }
    }
}

TEST(BackwardEuler, LinearMomentumIsKept)
{
    constexpr double kAStep = 1e-13;  // relative to sum m |v|: rounding of the sums
    const lab::Block block({5, 4, 3}, 0.1);
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000));
    const solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
    solver::State state = shaken(block, 0.1, 1, 1);
    for (Vec3& v : state.v) v += Vec3(1, 2, -1);
    const lab::Momentum start = lab::momentum(elastic, state.v);
    for (int n = 1; n <= 20; ++n) {
        const Vec3 before = lab::momentum(elastic, state.v).linear;
        EXPECT_EQ(step(state, 0.01, elastic, boundary).status, solver::StepStatus::converged);
        const double drift = (lab::momentum(elastic, state.v).linear - before).norm() / start.scale;
        EXPECT_LE(drift, kAStep) << "step " << n;
    }
}

TEST(BackwardEuler, SettingsOfAUserKeepMomentumToo)
{
    // What the solve leaves of the gradient must not push the body as a whole.
    constexpr double kAStep = 1e-13;
    const lab::Block block({5, 4, 3}, 0.1);
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000));
    const solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
    solver::State state = shaken(block, 0.1, 1, 1);
    for (Vec3& v : state.v) v += Vec3(1, 2, -1);
    const lab::Momentum start = lab::momentum(elastic, state.v);
    double worst = 0;
    for (int n = 1; n <= 20; ++n) {
        const Vec3 before = lab::momentum(elastic, state.v).linear;
        EXPECT_EQ(step(state, 0.01, elastic, boundary, {}).status, solver::StepStatus::converged);
        worst = std::max(worst, (lab::momentum(elastic, state.v).linear - before).norm() / start.scale);
    }
    std::printf("worst drift of momentum a step, default settings: %.2e\n", worst);
    EXPECT_LE(worst, kAStep);
}

TEST(BackwardEuler, StiffBodySpinsDownAsPredicted)
{
    constexpr double w0 = 2, dt = 0.01;
    constexpr double kNextOrder = 2 * (w0 * dt) * (w0 * dt);  // relative: the first term that the formula leaves out
    const lab::Block block({2, 2, 2}, 0.1);
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e9, .3, 1000));
    const solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
    solver::State state = lab::atRest(block);
    const Vec3 center = Vec3::Constant(block.h);
    // Lumped masses favour the corners on the tets' common diagonal: of the axes through the center, that one is
    // principal.
    const Vec3 axis = Vec3::Ones().normalized();
    for (std::size_t i = 0; i < state.x.size(); ++i) {
        state.x[i] -= center;
        state.v[i] = w0 * axis.cross(state.x[i]);
    }
    for (int n = 1; n <= 200; ++n) {
        const auto report = step(state, dt, elastic, boundary);
        EXPECT_EQ(report.status, solver::StepStatus::converged)
            << n << " residual " << report.residual << " newton " << report.newtonIterations;
        double spin = 0, inertia = 0;
        for (std::size_t i = 0; i < state.x.size(); ++i) {
            spin += elastic.mass()[i] * axis.dot(state.x[i].cross(state.v[i]));
            inertia += elastic.mass()[i] * axis.cross(state.x[i]).squaredNorm();
        }
        const double expected = w0 / std::sqrt(1 + 2 * w0 * w0 * dt * (n * dt));
        EXPECT_NEAR(spin / inertia, expected, kNextOrder * expected) << n;
    }
}

TEST(BackwardEuler, AxialBarHasItsPeriod)
{
    constexpr int kSteps = 400;
    // Lumped masses on 16 cells: 1 - (pi/32)^2/24 = 4e-4; lumping across the section is uneven; time steps: 1e-4.
    constexpr double kDiscrete = 0.005;
    AxialBar bar;
    const double dt = bar.period / kSteps;
    std::vector<double> zeros;
    for (int n = 1; n <= kSteps; ++n) {
        const double before = bar.tip();
        EXPECT_EQ(step(bar.state, dt, bar.elastic, bar.boundary).status, solver::StepStatus::converged);
        if (before * bar.tip() < 0) zeros.push_back(dt * (n - 1 + before / (before - bar.tip())));
    }
    ASSERT_EQ(zeros.size(), 2u);
    std::printf("axial period / theory: %.5f\n", 2 * (zeros[1] - zeros[0]) / bar.period);
    EXPECT_NEAR(2 * (zeros[1] - zeros[0]), bar.period, kDiscrete * bar.period);
}

TEST(BackwardEuler, ConvergesFirstOrderInTime)
{
    const auto tipAfter = [](int steps) {
        AxialBar bar;
        const double end = 0.2 * bar.period;  // the tip moves fast there
        for (int n = 0; n < steps; ++n)
            EXPECT_EQ(step(bar.state, end / steps, bar.elastic, bar.boundary).status, solver::StepStatus::converged);
        return bar.tip();
    };
    const double coarse = tipAfter(20), middle = tipAfter(40), fine = tipAfter(80), reference = tipAfter(1280);
    const double first = std::log2((coarse - reference) / (middle - reference));
    const double second = std::log2((middle - reference) / (fine - reference));
    std::printf("observed orders in time: %.3f %.3f\n", first, second);
    EXPECT_GE(first, 0.9);
    EXPECT_GE(second, 0.9);
}

TEST(BackwardEuler, EnergyNeverGrowsWithoutLoads)
{
    constexpr double kRounding = 1e-12;  // of the energy at the start
    for (Volumetric volumetric : {Volumetric::cell, Volumetric::none}) {
        const lab::Block block({4, 3, 3}, 0.1);
        const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000), volumetric);
        const solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
        solver::State state = lab::atRest(block);
        for (Vec3& x : state.x) x = Vec3(1.5, .8, .8).cwiseProduct(x);
        const double start = elastic.evaluate(state.x, {}, nullptr);
        double before = start;
        for (int n = 1; n <= 60; ++n) {
            const auto report = step(state, 1e-3, elastic, boundary);
            EXPECT_EQ(report.status, solver::StepStatus::converged);
            const double now = report.elasticEnergy + lab::kineticEnergy(elastic, state.v);
            EXPECT_LE(now, before + kRounding * start) << n;
            before = now;
        }
        EXPECT_LT(before, start);
    }
}

TEST(BackwardEuler, SameBitsForAnyNumberOfThreads)
{
    const lab::Block block({20, 10, 10}, 0.1);  // several patches
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000));
    const solver::Boundary boundary = lab::clamped(block, [](Coord c) { return c.x == 0; });
    std::uint64_t first = 0;
    for (int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        solver::State state = shaken(block, 0.2, 1, 5);
        for (int n = 0; n < 10; ++n) (void)step(state, 0.01, elastic, boundary, {});
        const std::uint64_t hash = hashOf(std::span<const Vec3>(state.v), hashOf(std::span<const Vec3>(state.x)));
        if (threads == 1) first = hash;
        EXPECT_EQ(hash, first) << threads << " threads";
    }
}

}  // namespace
