// Couplings between nodes: as a matrix, in every linear solver, and in a step.
#include "solids.h"
#include "spring.h"

#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/integrator.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

using namespace vdbfrac;
using solver::Coupling;
using solver::LinearMethod;
using solver::LinearStatus;
using solver::NodeBlocks;
using test::Block;
using test::kGel;
using test::Solid;

namespace {

Mat3 matrixOf(const solver::SymmetricBlock& q)
{
    Mat3 m;
    m << q[0], q[5], q[4], q[5], q[1], q[3], q[4], q[3], q[2];
    return m;
}

std::vector<Coupling> randomCouplings(std::size_t count, std::uint32_t nodes)
{
    std::mt19937 random(3);
    std::vector<Coupling> couplings(count);
    for (Coupling& c : couplings) {
        const Vec3 n = test::randomVec(random, 1);
        c.Q = {float(n.x() * n.x()), float(n.y() * n.y()), float(n.z() * n.z()),
               float(n.y() * n.z()), float(n.z() * n.x()), float(n.x() * n.y())};
        const std::uint32_t first = random() % nodes;
        for (std::uint32_t a = 0; a < Coupling::kNodes; ++a) {
            c.node[a] = (first + 3 * a) % nodes;
            c.weight[a] = a < 6 ? float(test::randomVec(random, 1).x()) : 0;  // two are not used
        }
    }
    return couplings;
}

/// The same as a dense matrix, straight from its definition.
Eigen::MatrixXd dense(std::span<const Coupling> couplings, std::size_t nodes)
{
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(Eigen::Index(3 * nodes), Eigen::Index(3 * nodes));
    for (const Coupling& c : couplings)
        for (std::size_t a = 0; a < Coupling::kNodes; ++a)
            for (std::size_t b = 0; b < Coupling::kNodes; ++b)
                H.block<3, 3>(3 * Eigen::Index(c.node[a]), 3 * Eigen::Index(c.node[b])) +=
                    double(c.weight[a]) * double(c.weight[b]) * matrixOf(c.Q);
    return H;
}

Eigen::MatrixXd dense(const NodeBlocks& blocks, std::size_t nodes)
{
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(Eigen::Index(3 * nodes), Eigen::Index(3 * nodes));
    for (std::size_t r = 0; r < blocks.rows(); ++r)
        for (const auto& e : blocks.entries(r))
            H.block<3, 3>(3 * Eigen::Index(blocks.node(r)), 3 * Eigen::Index(e.node)) = matrixOf(e.block);
    return H;
}

constexpr double kSingle = 1e-6;  // some ten roundings of a float

TEST(NodeBlocks, AreTheSumOfTheCouplings)
{
    constexpr std::uint32_t kNodes = 40;
    const auto couplings = randomCouplings(60, kNodes);
    const NodeBlocks blocks(couplings, kNodes);
    const Eigen::MatrixXd H = dense(blocks, kNodes), expected = dense(couplings, kNodes);
    EXPECT_LT((H - expected).norm(), kSingle * expected.norm());
    EXPECT_EQ((H - H.transpose()).norm(), 0);
    for (std::size_t r = 0; r < blocks.rows(); ++r)
        EXPECT_EQ(matrixOf(blocks.diagonal(r)), (H.block<3, 3>(3 * blocks.node(r), 3 * blocks.node(r))));
}

TEST(NodeBlocks, MultiplyAsTheirMatrixWithAnyNumberOfThreads)
{
    constexpr std::uint32_t kNodes = 3000;
    const auto couplings = randomCouplings(5000, kNodes);
    std::mt19937 random(5);
    std::vector<Vec3> u;
    for (std::uint32_t i = 0; i < kNodes; ++i) u.push_back(test::randomVec(random, 1));
    std::uint64_t hashes[2];
    for (int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        const NodeBlocks blocks(couplings, kNodes);
        std::vector<Vec3> Hu(kNodes, Vec3::Zero()), expected(kNodes, Vec3::Zero());
        const double energy = blocks.multiply<Vec3>(u, [&](std::uint32_t node, const Vec3& sum) { Hu[node] += sum; });
        double expectedEnergy = 0;
        for (const Coupling& c : couplings) {
            Vec3 y = Vec3::Zero();
            for (std::size_t a = 0; a < Coupling::kNodes; ++a) y += double(c.weight[a]) * u[c.node[a]];
            expectedEnergy += y.dot(matrixOf(c.Q) * y);
            for (std::size_t a = 0; a < Coupling::kNodes; ++a)
                expected[c.node[a]] += double(c.weight[a]) * (matrixOf(c.Q) * y);
        }
        EXPECT_LT(test::norm(test::difference(Hu, expected)), kSingle * test::norm(expected));
        EXPECT_NEAR(energy, expectedEnergy, kSingle * expectedEnergy);
        hashes[threads - 1] = hashBytes(Hu.data(), Hu.size() * sizeof(Vec3), hashBytes(&energy, sizeof energy));
    }
    EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(NodeBlocks, RestrictAsTheGalerkinProductOverFreeNodes)
{
    constexpr std::uint32_t kNodes = 30, kCoarse = 12;
    const auto couplings = randomCouplings(50, kNodes);
    std::mt19937 random(7);
    std::vector<std::array<std::uint32_t, 2>> parents(kNodes);
    std::vector<std::uint8_t> fixed(kNodes, 0);
    Eigen::MatrixXd P = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kCoarse);
    for (std::uint32_t n = 0; n < kNodes; ++n) {
        for (auto& p : parents[n]) p = random() % kCoarse;
        if (n % 7 == 0) parents[n][1] = parents[n][0];
        if (n == 11) parents[n].fill(0xffffffff);
        fixed[n] = n % 5 == 0;
        for (std::uint32_t p : parents[n])
            if (p < kCoarse && !fixed[n]) P.block<3, 3>(3 * n, 3 * p) += 0.5 * Mat3::Identity();
    }
    const Eigen::MatrixXd expected = P.transpose() * dense(couplings, kNodes) * P;
    const Eigen::MatrixXd H = dense(NodeBlocks(couplings, kNodes).restricted(parents, fixed, kCoarse), kCoarse);
    EXPECT_LT((H - expected).norm(), kSingle * expected.norm());
}

/// Two blocks on the floor whose tops are tied to each other at points that do not match, `beta` times as stiff as a
/// cell.
struct TiedBlocks {
    std::unique_ptr<Solid> solid;
    std::vector<Coupling> couplings;
    NodeBlocks blocks;

    TiedBlocks(int cells, double beta, double massFactor = 0)
    {
        const Block block({cells, cells, cells}, 1. / cells);
        solid = std::make_unique<Solid>(std::vector<Solid::Body>{{block, kGel}, {block, kGel}},
                                        Solid::Conditions{.held = test::onFloor, .massFactor = massFactor});
        const float k = float(beta * kGel.youngsModulus() * block.h);
        const std::uint32_t layer = std::uint32_t((cells + 1) * (cells + 1)), top = layer * std::uint32_t(cells);
        for (std::uint32_t j = 0; j < std::uint32_t(cells); ++j)
            for (std::uint32_t i = 1; i < std::uint32_t(cells); ++i) {
                const std::uint32_t corner = top + j * std::uint32_t(cells + 1) + i;
                Coupling c;
                tie(c, 0, corner, std::uint32_t(cells + 1), .3f, .7f, 1);
                tie(c, 4, corner - 1 + std::uint32_t(block.nodes.size()), std::uint32_t(cells + 1), .9f, .4f, -1);
                c.Q = {0, 0, k, 0, 0, 0};
                couplings.push_back(c);
            }
        blocks = NodeBlocks(couplings, solid->nodeCount());
    }

    solver::LinearSystem system(bool tied = true) const
    {
        solver::LinearSystem system = solid->system();
        system.blocks = tied ? &blocks : nullptr;
        return system;
    }
    std::vector<Vec3> pull() const
    {
        std::vector<Vec3> b(solid->nodeCount(), Vec3::Zero());
        for (std::size_t i = 0; i < b.size(); ++i)
            if (!solid->fixed()[i]) b[i] = solid->elastic().mass()[i] * Vec3(1, 2, i < b.size() / 2 ? 3 : -5);
        return b;
    }

private:
    static void tie(Coupling& c, std::size_t place, std::uint32_t corner, std::uint32_t row, float u, float v,
                    float sign)
    {
        const std::uint32_t node[] = {corner, corner + 1, corner + row, corner + row + 1};
        const float weight[] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
        for (std::size_t a = 0; a < 4; ++a) c.node[place + a] = node[a], c.weight[place + a] = sign * weight[a];
    }
};

struct Solved {
    std::vector<Vec3> u;
    int iterations = 0;
};

Solved solve(const TiedBlocks& tied, LinearMethod method, double tolerance, bool withTies = true)
{
    solver::LinearSolver linear(tied.solid->elastic(), method, solver::LinearPrecision::doubles);
    Solved result{std::vector<Vec3>(tied.solid->nodeCount()), 0};
    const auto report = linear.solve(tied.system(withTies), tied.pull(), result.u, {tolerance, 20000});
    EXPECT_EQ(report.status, LinearStatus::converged);
    EXPECT_EQ(report.method, method);
    result.iterations = report.iterations;
    return result;
}

TEST(CoupledSystems, AllMethodsAgree)
{
    constexpr double kTolerance = 1e-10, kError = 100 * kTolerance;  // condition numbers below 1e4, by the iterations
    const TiedBlocks tied(8, 10);
    const std::vector<Vec3> direct = solve(tied, LinearMethod::direct, 1).u;
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid})
        EXPECT_LT(test::norm(test::difference(solve(tied, method, kTolerance).u, direct)), kError * test::norm(direct))
            << int(method);
    // And the ties matter: without them the solution is another.
    const std::vector<Vec3> loose = solve(tied, LinearMethod::direct, 1, false).u;
    EXPECT_GT(test::norm(test::difference(loose, direct)), 0.1 * test::norm(direct));
}

/// Iterations of multigrid to 1e-6, and how many more couplings make of them.
void expectFewMore(int cells, std::size_t ties, int more)
{
    for (double massFactor : {0., 1e4}) {
        TiedBlocks tied(cells, 10, massFactor);
        tied.couplings.resize(std::min(ties, tied.couplings.size()));
        tied.blocks = NodeBlocks(tied.couplings, tied.solid->nodeCount());
        const int loose = solve(tied, LinearMethod::multigrid, 1e-6, false).iterations;
        const int coupled = solve(tied, LinearMethod::multigrid, 1e-6).iterations;
        std::printf("%d cells, mass factor %g, %zu ties: %d iterations, without %d\n", cells, massFactor,
                    tied.couplings.size(), coupled, loose);
        EXPECT_LE(coupled, loose + more) << cells << " cells, " << massFactor;
    }
}

TEST(CoupledSystems, ASpringTakesMultigridNoMoreThanOneIterationMore)
{
    for (int cells : {16, 24}) expectFewMore(cells, 1, 1);
}

/// A whole face of ten times the stiffness of the cells: what comes on top does not grow with the lattice.
TEST(CoupledSystems, PressedFacesTakeMultigridAFewIterationsMore)
{
    for (int cells : {12, 16, 24}) expectFewMore(cells, ~std::size_t{0}, 4);
}

TEST(CoupledSystems, PreconditionerTakesUpWhatHasChangedMuch)
{
    const TiedBlocks tied(16, 10);
    for (LinearMethod method : {LinearMethod::multigrid, LinearMethod::jacobi}) {
        solver::LinearSolver linear(tied.solid->elastic(), method);
        std::vector<Vec3> u(tied.solid->nodeCount());
        const auto once = [&](bool withTies, bool same) {
            const auto report = linear.solve(tied.system(withTies), tied.pull(), u, {1e-6, 20000}, same);
            EXPECT_EQ(report.status, LinearStatus::converged);
            return report.iterations;
        };
        const int fresh = once(true, false);
        (void)once(false, false);
        EXPECT_EQ(once(true, true), fresh) << int(method);
    }
}

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
        boundary = test::freeBoundary(2 * n);
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
    for (Vec3& v : u) v = test::randomVec(random, 1);
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
    (void)NodeBlocks(couplings, n).multiply<Vec3>(u, [&](std::uint32_t i, const Vec3& sum) { Hu[i] += sum; });
    for (std::size_t i = 0; i < n; ++i)
        EXPECT_LT(((plus[i] - minus[i]) / (2 * kStep) - Hu[i]).norm(), kError * test::norm(Hu)) << i;
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
    solver::NewtonSettings settings = test::tightSettings();
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
