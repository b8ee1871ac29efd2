// Parts of the material that springs couple: their forces, their momentum, and when a step is long enough.
#include "../../solver/src/objective.h"
#include "spring.h"

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/solver/integrator.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

using namespace vdbfrac;
using lab::Block;
using lab::kGel;
using solver::Coupling;
using solver::LinearMethod;
using solver::NodeBlocks;

namespace {

/// Two free blocks of 2^3 cells, one above the other, and a spring from the one to the other.
struct SpringedBlocks {
    Block block{{2, 2, 2}, .1};
    std::vector<solver::ElementSet> sets;
    std::unique_ptr<solver::ElasticOperator> elastic;
    solver::State state;
    solver::Boundary boundary;
    std::unique_ptr<test::Spring> spring;

    explicit SpringedBlocks(double stiffness, double length = .1, double gap = .25)
    {
        const std::uint32_t n = std::uint32_t(block.nodes.size());
        sets = {{block.elements, block.nodes, 0, kGel}, {block.elements, block.nodes, n, kGel}};
        elastic = std::make_unique<solver::ElasticOperator>(sets, 2 * n, block.h, solver::Volumetric::cell);
        for (const Vec3& offset : {Vec3(0, 0, 0), Vec3(.03, .3, .02)})
            for (const Vec3& X : block.restPositions())
                state.x.push_back(X + offset + Vec3(0, offset.y() > 0 ? gap : 0, 0));
        state.v.assign(2 * n, Vec3(.1, .2, -.3));
        boundary = lab::freeBoundary(2 * n);
        boundary.part.assign(n, 0);
        boundary.part.insert(boundary.part.end(), n, 1);
        const auto at = [&](std::uint32_t first, std::array<std::uint32_t, 4> node) {
            for (auto& i : node) i += first;
            return tetmesh::EmbeddedPoint{node, {.4, .3, .2, .1}};
        };
        spring = std::make_unique<test::Spring>(at(0, {6, 7, 15, 16}), at(n, {0, 1, 9, 10}), stiffness, length);
    }
    Vec3 momentum(std::size_t first, std::size_t count) const
    {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = first; i < first + count; ++i) sum += elastic->mass()[i] * state.v[i];
        return sum;
    }
    Vec3 momentum() const { return momentum(0, state.x.size()); }
};

TEST(Spring, GradientAndHessianAreThoseOfItsEnergy)
{
    constexpr double kStep = 1e-5, kError = 1e-6;  // of central differences: the square of the step, and rounding
    SpringedBlocks blocks(300, .05);
    const std::size_t n = blocks.state.x.size();
    std::mt19937 random(2);
    std::vector<Vec3> u(n), gradient(n, Vec3::Zero()), plus(n, Vec3::Zero()), minus(n, Vec3::Zero()),
        x = blocks.state.x;
    for (Vec3& v : u) v = lab::randomVec(random, 1);
    blocks.spring->evaluate(x, gradient);
    std::vector<Coupling> couplings;
    blocks.spring->linearize(x, couplings);
    const auto moved = [&](double step) {
        std::vector<Vec3> y = x;
        for (std::size_t i = 0; i < n; ++i) y[i] += step * u[i];
        return y;
    };
    const double slope = (blocks.spring->energy(moved(kStep)) - blocks.spring->energy(moved(-kStep))) / (2 * kStep);
    EXPECT_NEAR(slope, solver::dot(gradient, u), kError * std::abs(slope));
    blocks.spring->evaluate(moved(kStep), plus);
    blocks.spring->evaluate(moved(-kStep), minus);
    std::vector<Vec3> Hu(n, Vec3::Zero());
    (void)NodeBlocks({couplings}, n).multiply<Vec3>(u, [&](std::uint32_t i, const Vec3& sum) { Hu[i] += sum; });
    for (std::size_t i = 0; i < n; ++i)
        EXPECT_LT(((plus[i] - minus[i]) / (2 * kStep) - Hu[i]).norm(), kError * lab::norm(Hu)) << i;
}

/// A step shifts loose parts to keep their momentum; parts that a spring joins exchange theirs.
TEST(CoupledParts, ExchangeMomentumAndKeepTheirSum)
{
    constexpr double kRounding = 1e-12;  // of the momentum
    SpringedBlocks blocks(500);
    solver::BackwardEuler stepper(*blocks.elastic, {});
    solver::Potential* potentials[] = {blocks.spring.get()};
    const Vec3 sum = blocks.momentum(), first = blocks.momentum(0, blocks.block.nodes.size());
    for (int step = 0; step < 5; ++step) {
        const auto& report = stepper.step(blocks.state, 1. / 240, {potentials, blocks.boundary});
        ASSERT_EQ(report.status, solver::StepStatus::converged);
        EXPECT_EQ(report.couplings, 1u);
        EXPECT_LT((blocks.momentum() - sum).norm(), kRounding * sum.norm()) << step;
    }
    // 500 N/m stretched by .18 m for 5/240 s is about 1.9 N s.
    EXPECT_GT((blocks.momentum(0, blocks.block.nodes.size()) - first).norm(), 1);
}

TEST(CoupledParts, OfNoSpringReportNone)
{
    SpringedBlocks blocks(500);
    solver::BackwardEuler stepper(*blocks.elastic, {});
    const auto& report = stepper.step(blocks.state, 1. / 240, {{}, blocks.boundary});
    EXPECT_EQ(report.couplings, 0u);
}

/// The lower block is held; the upper hangs from it by nothing but the spring: statics do not freeze it.
TEST(CoupledParts, ThatHangOnAHeldOneAreNotFrozen)
{
    SpringedBlocks blocks(500, .1, 0);
    const std::size_t n = blocks.block.nodes.size();
    for (std::size_t i = 0; i < n; ++i) {
        blocks.boundary.fixed[i] = 1;
        blocks.boundary.target[i] = blocks.state.x[i];
    }
    const double pull = 3;  // N, along y
    for (std::size_t i = n; i < 2 * n; ++i) blocks.boundary.force[i].y() = pull / double(n);
    solver::NewtonSettings settings = lab::tightSettings();
    settings.linearMethod = LinearMethod::direct;
    const double still = std::numeric_limits<double>::infinity();
    const auto without =
        solver::stepBackwardEuler(*blocks.elastic, blocks.state, still, {{}, blocks.boundary}, settings);
    EXPECT_EQ(without.frozenNodes, n);
    // A second spring across and a third hold it against turning: three springs to points that are apart.
    const auto corner = [&](std::uint32_t first, std::uint32_t node) {
        const std::uint32_t i = first + node;
        return tetmesh::EmbeddedPoint{{i, i, i, i}, {1, 0, 0, 0}};
    };
    std::vector<std::unique_ptr<test::Spring>> springs;
    std::vector<solver::Potential*> potentials;
    for (const auto& [lower, upper] : {std::pair{6u, 0u}, {8u, 2u}, {24u, 18u}, {26u, 20u}}) {
        springs.push_back(std::make_unique<test::Spring>(corner(0, lower), corner(std::uint32_t(n), upper), 500, 0));
        potentials.push_back(springs.back().get());
    }
    const auto with =
        solver::stepBackwardEuler(*blocks.elastic, blocks.state, still, {potentials, blocks.boundary}, settings);
    EXPECT_EQ(with.frozenNodes, 0u);
    ASSERT_EQ(with.status, solver::StepStatus::converged);
    std::vector<Vec3> force(2 * n, Vec3::Zero());
    for (const auto& spring : springs) spring->evaluate(blocks.state.x, force);
    Vec3 upper = Vec3::Zero();
    for (std::size_t i = n; i < 2 * n; ++i) upper += force[i];
    EXPECT_LT((upper - Vec3(0, pull, 0)).norm(), 1e-9 * pull);
}

/// How far off a node is depends on what holds it: a touch, where its own tets hardly do.
TEST(CoupledParts, AreAsFarOffAsTheirSpringHoldsThem)
{
    constexpr double kShare = 1e-10, kOff = 1e-3, kDt = 1. / 240;  // of a cell; m; s
    SpringedBlocks blocks(0);
    const auto n = std::uint32_t(blocks.block.nodes.size());
    std::vector<tetmesh::CellElement> light = blocks.block.elements;
    for (auto& fraction : light[0].fraction) fraction *= kShare;  // it alone has node n
    blocks.sets[1].elements = light;
    const solver::ElasticOperator elastic(blocks.sets, 2 * n, blocks.block.h, solver::Volumetric::cell);
    blocks.state.v.assign(2 * n, Vec3::Zero());
    const Vec3 to = blocks.state.x[n] - blocks.state.x[6];
    constexpr double kCounted = 0.1;              // share of the spring
    for (const double stiffness : {1e-2, 1e4}) {  // N/m; the node's own tets and inertia have 1e-6
        test::Spring spring({{6, 6, 6, 6}, {1, 0, 0, 0}}, {{n, n, n, n}, {1, 0, 0, 0}}, stiffness, to.norm());
        solver::Potential* potentials[] = {&spring};
        solver::Objective objective;
        objective.rebind(elastic);
        objective.begin(blocks.state, kDt, {potentials, blocks.boundary});
        solver::Point p{blocks.state.x, std::vector<Vec3>(2 * n, Vec3::Zero())};
        p.x[n] += kOff * to.normalized();
        objective.evaluate(p);
        EXPECT_NEAR(kCounted * objective.farthest(p), kOff, 0.02 * kOff) << stiffness;
    }
}

/// Far from the origin a stiff spring at rest has forces of rounding only; they are no reason to iterate.
TEST(CoupledParts, InFreeFlightTakeNoIterations)
{
    SpringedBlocks blocks(1e9, (Vec3(.03, .55, .02) - Vec3(0, .2, 0)).norm());
    for (Vec3& x : blocks.state.x) x += Vec3(50, 20, -30);
    // The spring is as long as the points are apart.
    const Vec3 apart = blocks.state.x[blocks.block.nodes.size()] - blocks.state.x[6];
    test::Spring spring({{6, 6, 6, 6}, {1, 0, 0, 0}},
                        {{std::uint32_t(blocks.block.nodes.size()), 0, 0, 0}, {1, 0, 0, 0}}, 1e9, apart.norm());
    solver::Potential* potentials[] = {&spring};
    solver::BackwardEuler stepper(*blocks.elastic, {});
    for (int step = 0; step < 5; ++step) {
        const auto& report = stepper.step(blocks.state, 1. / 24, {potentials, blocks.boundary});
        EXPECT_EQ(report.status, solver::StepStatus::converged);
        EXPECT_EQ(report.newtonIterations, 0) << step;
    }
}

/// The bound of explicit steps holds with springs: just below it vibrations stay, at twice it they grow.
TEST(CoupledParts, BoundExplicitSteps)
{
    for (const double factor : {0.99, 4.}) {
        SpringedBlocks blocks(2e6);
        solver::Potential* potentials[] = {blocks.spring.get()};
        const auto scheme = solver::makeIntegrator(solver::Scheme::symplecticEuler, *blocks.elastic, {});
        const double bound = scheme->largestStep(potentials, blocks.state.x);
        EXPECT_LT(bound, 0.5 * scheme->largestStep({}, blocks.state.x));
        blocks.state.v[0] += Vec3(0, 1e-3, 0);
        for (int step = 0; step < 400; ++step)
            (void)scheme->step(blocks.state, factor * bound,
                               {potentials, [&](double) -> const solver::Boundary& { return blocks.boundary; }});
        double fastest = 0;
        for (const Vec3& v : blocks.state.v) fastest = std::isfinite(v.norm()) ? std::max(fastest, v.norm()) : INFINITY;
        EXPECT_EQ(fastest < 1e3, factor < 1) << factor << ": " << fastest;
    }
}

}  // namespace
