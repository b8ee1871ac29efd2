// Couplings between nodes: as a matrix, and in every linear solver.
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

using namespace vdbfrac;
using lab::Block;
using lab::kGel;
using lab::Solid;
using solver::Coupling;
using solver::LinearMethod;
using solver::LinearStatus;
using solver::NodeBlocks;

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
        const Vec3 n = lab::randomVec(random, 1);
        c.Q = {float(n.x() * n.x()), float(n.y() * n.y()), float(n.z() * n.z()),
               float(n.y() * n.z()), float(n.z() * n.x()), float(n.x() * n.y())};
        const std::uint32_t first = random() % nodes;
        for (std::uint32_t a = 0; a < Coupling::kNodes; ++a) {
            c.node[a] = (first + 3 * a) % nodes;
            c.weight[a] = a < 6 ? float(lab::randomVec(random, 1).x()) : 0;  // two are not used
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
            H.block<3, 3>(3 * Eigen::Index(blocks.node(r)), 3 * Eigen::Index(e.node)) = e.block.cast<double>();
    return H;
}

constexpr double kSingle = 1e-6;  // some ten roundings of a float

TEST(NodeBlocks, AreTheSumOfTheCouplings)
{
    constexpr std::uint32_t kNodes = 40;
    const auto couplings = randomCouplings(60, kNodes);
    const NodeBlocks blocks({couplings}, kNodes);
    const Eigen::MatrixXd H = dense(blocks, kNodes), expected = dense(couplings, kNodes);
    EXPECT_LT((H - expected).norm(), kSingle * expected.norm());
    EXPECT_EQ((H - H.transpose()).norm(), 0);
    for (std::size_t r = 0; r < blocks.rows(); ++r)
        EXPECT_EQ(matrixOf(blocks.diagonal(r)), (H.block<3, 3>(3 * blocks.node(r), 3 * blocks.node(r))));
}

/// Curvatures of numbers alone, and beside points: their blocks are not symmetric, the whole is.
TEST(NodeBlocks, AreTheSumWithThoseOfNumbers)
{
    constexpr std::uint32_t kNodes = 40;
    std::mt19937 random(5);
    std::vector<solver::ScalarCoupling> scalars(50);
    Eigen::MatrixXd ofScalars = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kNodes);
    for (solver::ScalarCoupling& c : scalars) {
        Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * kNodes);
        const std::uint32_t first = random() % kNodes;
        for (std::uint32_t a = 0; a < c.node.size(); ++a) {
            c.node[a] = (first + 5 * a) % kNodes;
            c.gradient[a] = ((a < 6 ? 1 : 0) * lab::randomVec(random, 1)).cast<float>();  // two are not used
            g.segment<3>(3 * c.node[a]) += c.gradient[a].cast<double>();
        }
        ofScalars += g * g.transpose();
    }
    const auto points = randomCouplings(60, kNodes);
    const Eigen::MatrixXd alone = dense(NodeBlocks({{}, scalars}, kNodes), kNodes);
    EXPECT_LT((alone - ofScalars).norm(), kSingle * ofScalars.norm());
    EXPECT_LT((alone - alone.transpose()).norm(), kSingle * ofScalars.norm());
    const NodeBlocks both({points, scalars}, kNodes);
    const Eigen::MatrixXd expected = ofScalars + dense(points, kNodes), H = dense(both, kNodes);
    EXPECT_LT((H - expected).norm(), kSingle * expected.norm());
    std::vector<Vec3> u(kNodes), Hu(kNodes, Vec3::Zero());
    for (Vec3& v : u) v = lab::randomVec(random, 1);
    const Eigen::Map<const Eigen::VectorXd> flat(u[0].data(), 3 * kNodes);
    const double energy = both.multiply<Vec3>(u, [&](std::uint32_t n, const Vec3& sum) { Hu[n] += sum; });
    EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(Hu[0].data(), 3 * kNodes) - expected * flat).norm(),
              kSingle * expected.norm() * flat.norm());
    EXPECT_NEAR(energy, flat.dot(expected * flat), kSingle * expected.norm() * flat.squaredNorm());
    std::vector<double> mass(kNodes, 2.);
    EXPECT_GE(std::pow(solver::highestFrequency({points, scalars}, mass), 2), expected.operatorNorm() / 2);
}

TEST(NodeBlocks, MultiplyAsTheirMatrixWithAnyNumberOfThreads)
{
    constexpr std::uint32_t kNodes = 3000;
    const auto couplings = randomCouplings(5000, kNodes);
    std::mt19937 random(5);
    std::vector<Vec3> u;
    for (std::uint32_t i = 0; i < kNodes; ++i) u.push_back(lab::randomVec(random, 1));
    std::uint64_t hashes[2];
    for (int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        const NodeBlocks blocks({couplings}, kNodes);
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
        EXPECT_LT(lab::norm(lab::difference(Hu, expected)), kSingle * lab::norm(expected));
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
    const Eigen::MatrixXd H = dense(NodeBlocks({couplings}, kNodes).restricted(parents, fixed, kCoarse), kCoarse);
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
                                        Solid::Conditions{.held = lab::onFloor, .massFactor = massFactor});
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
        blocks = NodeBlocks({couplings}, solid->nodeCount());
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
        EXPECT_LT(lab::norm(lab::difference(solve(tied, method, kTolerance).u, direct)), kError * lab::norm(direct))
            << int(method);
    // And the ties matter: without them the solution is another.
    const std::vector<Vec3> loose = solve(tied, LinearMethod::direct, 1, false).u;
    EXPECT_GT(lab::norm(lab::difference(loose, direct)), 0.1 * lab::norm(direct));
}

/// Couplings come and go from one system to the next, and with them the places of the matrix.
TEST(CoupledSystems, OneSolverTakesThemAsTheyCome)
{
    constexpr double kTolerance = 1e-10, kError = 1e4 * kTolerance;  // condition numbers below 1e4
    const TiedBlocks tied(8, 10);
    for (LinearMethod method : {LinearMethod::direct, LinearMethod::jacobi, LinearMethod::multigrid}) {
        solver::LinearSolver linear(tied.solid->elastic(), method, solver::LinearPrecision::doubles);
        for (const bool withTies : {false, true, false, true}) {
            std::vector<Vec3> u(tied.solid->nodeCount());
            EXPECT_EQ(linear.solve(tied.system(withTies), tied.pull(), u, {kTolerance, 20000}).status,
                      LinearStatus::converged);
            const std::vector<Vec3> fresh = solve(tied, method, kTolerance, withTies).u;
            EXPECT_LT(lab::norm(lab::difference(u, fresh)), kError * lab::norm(fresh)) << int(method) << withTies;
        }
    }
}

/// Iterations of multigrid to 1e-6, and how many more couplings make of them.
void expectFewMore(int cells, std::size_t ties, int more)
{
    for (double massFactor : {0., 1e4}) {
        TiedBlocks tied(cells, 10, massFactor);
        tied.couplings.resize(std::min(ties, tied.couplings.size()));
        tied.blocks = NodeBlocks({tied.couplings}, tied.solid->nodeCount());
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

/// What touches that did not when the W-cycle was made, among hundreds that go on touching.
TEST(CoupledSystems, AFewMoreOfManyAreTakenUp)
{
    TiedBlocks tied(16, 30);
    const std::vector<Coupling> all = tied.couplings;
    solver::LinearSolver linear(tied.solid->elastic(), LinearMethod::multigrid);
    std::vector<Vec3> u(tied.solid->nodeCount());
    const auto once = [&](std::size_t without, bool same) {
        tied.couplings = all;
        tied.couplings.erase(tied.couplings.begin() + std::ptrdiff_t(all.size() / 2),
                             tied.couplings.begin() + std::ptrdiff_t(all.size() / 2 + without));
        tied.blocks = NodeBlocks({tied.couplings}, tied.solid->nodeCount());
        return linear.solve(tied.system(), tied.pull(), u, {1e-6, 20000}, same);
    };
    const int fresh = once(0, false).iterations;
    for (const std::size_t more : {1u, 3u, 8u}) {
        (void)once(more, false);
        const auto report = once(0, true);
        EXPECT_EQ(report.status, LinearStatus::converged) << more;
        EXPECT_EQ(report.method, LinearMethod::multigrid) << more;
        EXPECT_LE(report.iterations, fresh + 3) << more;
    }
}

}  // namespace
