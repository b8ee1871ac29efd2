// The W-cycle as an operator, and the iterations that it leaves to conjugate gradients.
#include "../../solver/src/multigrid.h"

#include "case.h"

#include <vdbfrac/lab/samples/crack.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <ostream>
#include <random>
#include <string>
#include <utility>

using namespace vdbfrac;
using lab::Block;
using lab::kGel;
using lab::makeSolid;
using lab::onFloor;
using lab::Solid;
using solver::LinearMethod;
using solver::LinearStatus;
using Kind = tetmesh::Lattice::Kind;

namespace {

/// A cube parted half through, along its whole width.
Block halfParted(int cells, int plane)
{
    Block block({cells, cells, cells}, 1. / cells);
    lab::openCrack(block, {&Coord::z, plane}, [cells](Coord c) { return 2 * c.x > cells; });
    return block;
}

using Case = test::Case<std::unique_ptr<Solid>>;
constexpr auto nameOf = test::nameOf<std::unique_ptr<Solid>>;

class WCycle : public testing::TestWithParam<Case> {
protected:
    WCycle() : solid(GetParam().make()), multigrid(solid->elastic()) {}

    std::vector<Vec3> cycle(std::span<const Vec3> r)
    {
        const double scale = 1 / lab::norm(r);
        for (std::size_t i = 0; i < r.size(); ++i) multigrid.rightSide()[i] = (scale * r[i]).cast<float>();
        multigrid.apply();
        std::vector<Vec3> z;
        for (const solver::Vec3f& v : multigrid.result()) z.push_back(v.cast<double>() / scale);
        return z;
    }

    std::unique_ptr<Solid> solid;
    solver::Multigrid multigrid;
};

TEST_P(WCycle, IsSymmetricAndPositive)
{
    // Of sqrt(z1.r1 z2.r2): floats round at 6e-8, and a W-cycle adds some hundred terms on each level.
    constexpr double kSingle = 1e-5;
    ASSERT_TRUE(multigrid.setUp(solid->system()));
    ASSERT_GE(multigrid.levels(), 2);
    for (unsigned seed = 1; seed < 10; seed += 2) {
        const std::vector<Vec3> r1 = solid->randomForces(seed), r2 = solid->randomForces(seed + 1);
        const std::vector<Vec3> z1 = cycle(r1), z2 = cycle(r2);
        const double own1 = solver::dot(z1, r1), own2 = solver::dot(z2, r2);
        EXPECT_GT(own1, 0);
        EXPECT_GT(own2, 0);
        EXPECT_NEAR(solver::dot(z1, r2), solver::dot(z2, r1), kSingle * std::sqrt(own1 * own2));
    }
}

TEST_P(WCycle, DoesNotMoveFixedNodes)
{
    ASSERT_TRUE(multigrid.setUp(solid->system()));
    const std::vector<Vec3> z = cycle(solid->randomForces(1));
    for (std::size_t i = 0; i < z.size(); ++i) {
        if (!solid->fixed()[i]) continue;
        EXPECT_EQ(z[i], Vec3::Zero());
    }
}

/// Repeated on its own the cycle converges: no eigenvalue of B A is 2 or more, none is near 0.
TEST_P(WCycle, ReducesTheErrorAlone)
{
    constexpr int kCycles = 20;
    ASSERT_TRUE(multigrid.setUp(solid->system()));
    std::vector<Vec3> error = solid->randomForces(1);
    for (std::size_t i = 0; i < error.size(); ++i) error[i] /= std::max(solid->elastic().stiffness()[i], 1e-300);
    const auto energy = [&] { return solver::dot(error, solid->product(error)); };
    double before = energy(), slowest = 0;
    for (int n = 0; n < kCycles; ++n) {
        const std::vector<Vec3> z = cycle(solid->product(error));
        for (std::size_t i = 0; i < error.size(); ++i) error[i] -= z[i];
        const double now = energy();
        slowest = std::max(slowest, now / before);
        before = now;
    }
    std::printf("slowest reduction of the error by a cycle: %.3f\n", std::sqrt(slowest));
    EXPECT_LT(slowest, 1);
}

TEST_P(WCycle, IsTheSameAfterAnotherSystem)
{
    ASSERT_TRUE(multigrid.setUp(solid->system()));
    const std::vector<Vec3> r = solid->randomForces(1), z = cycle(r);
    solver::LinearSystem other = solid->system();
    other.massFactor = 1e5;
    const std::vector<std::uint8_t> none(r.size(), 0);
    other.fixed = none;
    ASSERT_TRUE(multigrid.setUp(other));
    EXPECT_NE(cycle(r), z);
    ASSERT_TRUE(multigrid.setUp(solid->system()));
    EXPECT_EQ(cycle(r), z);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, WCycle,
    testing::Values(
        Case{"block",
             [] {
                 return makeSolid(Block({13, 14, 15}, .1), {.held = onFloor});
             }},
        Case{"five",
             [] {
                 return makeSolid(Block({13, 14, 15}, .1, Kind::five), {.held = onFloor});
             }},
        Case{"halfParted", [] { return makeSolid(halfParted(14, 7), {.held = onFloor}); }},
        Case{"nearlyIncompressible",
             [] {
                 return makeSolid(Block({13, 14, 15}, .1), {.held = onFloor}, solver::makeMaterial(1e5, .49, 1000));
             }},
        Case{"ball",
             [] {
                 return makeSolid(lab::asBlock(lab::cutBall({Kind::six, 1, .1}, 7.3)),
                                  {.held = [](Coord c) { return c.z < -5; }});
             }},
        Case{"oddNodesHeld",
             [] {
                 const auto held = [](Coord c) {
                     return c == Coord{1, 1, 1} || c == Coord{9, 3, 1} || c == Coord{5, 9, 11};
                 };
                 return makeSolid(Block({13, 14, 15}, .1), {.held = held});
             }},
        Case{"free",
             [] {
                 return makeSolid(Block({13, 14, 15}, .1), {.held = [](Coord) { return false; }, .massFactor = 10});
             }}),
    nameOf);

/// Iterations to 1e-6 for a pull at the top.
int iterations(const Solid& solid, int top)
{
    std::vector<Vec3> b;
    for (const auto& set : solid.elastic().sets())
        for (Coord c : set.nodes) b.push_back(c.z == top ? Vec3(1, 2, 3) : Vec3::Zero());
    solver::LinearSolver linear(solid.elastic(), LinearMethod::multigrid);
    std::vector<Vec3> u(b.size());
    const auto report = linear.solve(solid.system(), b, u, {1e-6, 1000});
    EXPECT_EQ(report.status, LinearStatus::converged);
    EXPECT_EQ(report.method, LinearMethod::multigrid);
    return report.iterations;
}

/// Iterations for four times as many nodes a side. More than two more would be growth.
template <class Make>
void expectNoGrowth(const char* what, const Make& make, int smallest = 8)
{
    int first = 0;
    for (int cells : {smallest, 2 * smallest, 4 * smallest}) {
        const int now = iterations(*make(cells), cells);
        std::printf("%s, %d nodes a side: %d iterations\n", what, cells + 1, now);
        if (cells == smallest) first = now;
        EXPECT_LE(now, first + 2) << what << ", " << cells << " cells";
    }
}

TEST(MultigridIterations, DoNotGrowWithTheBlock)
{
    expectNoGrowth("block", [](int cells) {
        return makeSolid(Block({cells, cells, cells}, 1. / cells), {.held = onFloor});
    });
}

TEST(MultigridIterations, DoNotGrowWithACrackOnCoarseNodes)
{
    expectNoGrowth("crack on coarse nodes",
                   [](int cells) { return makeSolid(halfParted(cells, cells / 2), {.held = onFloor}); });
}

std::unique_ptr<Solid> halfPartedBetweenCoarseNodes(int cells)
{
    return makeSolid(halfParted(cells, cells / 2 - 1), {.held = onFloor});
}

/// Coarse elements that hold the front of a crack join its sides, which shortens it by up to two cells on every level.
/// With 8 cells there is only one such level that is not solved exactly.
TEST(MultigridIterations, DoNotGrowWithACrackBetweenCoarseNodes)
{
    expectNoGrowth("crack between coarse nodes", halfPartedBetweenCoarseNodes, 16);
}

TEST(MultigridIterations, DoNotGrowWithACrackThroughTheBlock)
{
    expectNoGrowth("crack through the block", [](int cells) {
        Block block({cells, cells, cells}, 1. / cells);
        lab::openCrack(block, {&Coord::z, cells / 2 - 1}, [](Coord) { return true; });
        return makeSolid(std::move(block), {.held = [](Coord c) { return c.x == 0; }});  // both halves
    });
}

TEST(MultigridIterations, DoNotGrowNearlyIncompressible)
{
    const auto rubber = solver::makeMaterial(1e5, .49, 1000);
    expectNoGrowth("nu = .49", [&](int cells) {
        return makeSolid(Block({cells, cells, cells}, 1. / cells), {.held = onFloor}, rubber);
    });
}

/// Most iterations for random forces on balls that the lattice cuts in different places.
int iterationsOnCutBalls(Kind kind, LinearMethod method = LinearMethod::multigrid)
{
    int most = 0;
    for (double r : {5.3, 7.3, 9.5, 11.6}) {
        const auto held = [r](Coord c) { return 2 * c.z < -r; };
        const auto solid = makeSolid(lab::asBlock(lab::cutBall({kind, 1, .1}, r)), {.held = held});
        solver::LinearSolver linear(solid->elastic(), method);
        std::vector<Vec3> u(solid->nodeCount());
        most = std::max(most, linear.solve(solid->system(), solid->randomForces(1), u, {1e-6, 1000}).iterations);
    }
    return most;
}

TEST(MultigridIterations, AreFewOnCutBalls)
{
    EXPECT_LE(iterationsOnCutBalls(Kind::six), 15);  // twice those of a block
}

/// A cut tet of five counts in the coarse tet round its middle, which need not have the coarse nodes that its corners
/// take their values from. Those are then too soft, and more iterations make up for it.
TEST(MultigridIterations, AreFewerThanJacobiOnCutBallsOfFive)
{
    EXPECT_LT(iterationsOnCutBalls(Kind::five), iterationsOnCutBalls(Kind::five, LinearMethod::jacobi));
}

struct CoarseLevel {
    solver::CoarseLattice lattice;
    std::vector<solver::ElementSet> sets;
    solver::ElasticOperator elastic;
    solver::Tangent tangent;

    explicit CoarseLevel(Solid& solid)
        : lattice(solver::coarsen(solid.elastic().sets(), solid.nodeCount())),
          sets(lattice.elementSets()),
          elastic(sets, lattice.nodeCount, 2 * solid.elastic().h(), solid.elastic().volumetric())
    {
        solver::Tangent cells;
        solid.elastic().averageTets(solid.tangent(), cells);
        elastic.averageCells(solid.elastic(), cells, lattice.finer, tangent);
    }
};

/// u.A u on the coarse level over that of the interpolated u, for u of one coarse node: least and largest.
std::pair<double, double> energyRatios(Solid& solid)
{
    const CoarseLevel coarse(solid);
    const std::vector<Mat3> blocks = lab::diagonalBlocks(coarse.elastic, coarse.tangent);
    std::vector<std::vector<std::uint32_t>> under(coarse.lattice.nodeCount);
    for (std::uint32_t n = 0; n < solid.nodeCount(); ++n)
        for (std::uint32_t parent : coarse.lattice.parents[n]) under[parent].push_back(n);
    double least = 1e300, largest = 0;
    std::vector<Vec3> u(solid.nodeCount(), Vec3::Zero());
    for (std::size_t c = 0; c < under.size(); ++c) {
        if (under[c].empty()) continue;
        for (std::uint32_t n : under[c]) u[n] += Vec3(0, 0, .5);
        const double ratio = blocks[c](2, 2) / solid.elastic().multiply<Vec3>(solid.tangent(), u).energy;
        least = std::min(least, ratio), largest = std::max(largest, ratio);
        for (std::uint32_t n : under[c]) u[n].setZero();
    }
    return {least, largest};
}

std::unique_ptr<Solid> evenlyStretched(Block block, solver::Volumetric volumetric)
{
    return makeSolid(std::move(block), {.held = onFloor, .volumetric = volumetric, .shake = 0});
}

TEST(CoarseOperator, IsTheGalerkinOperatorOnNestedLattices)
{
    constexpr double kStored = 1e-6;  // rotations and twist operators are kept, and averaged, in single precision
    Block block = halfParted(12, 5);
    const auto cracked = evenlyStretched(std::move(block), solver::Volumetric::none);
    const auto ball = evenlyStretched(lab::asBlock(lab::cutBall({Kind::six, 1, .1}, 7.3)), solver::Volumetric::none);
    for (Solid* solid : {cracked.get(), ball.get()}) {
        CoarseLevel coarse(*solid);
        std::mt19937 random(1);
        std::vector<Vec3> u(coarse.lattice.nodeCount), fine;
        for (Vec3& v : u) v = lab::randomVec(random, 1);
        for (const auto& [p, q] : coarse.lattice.parents) fine.push_back((u[p] + u[q]) / 2);
        std::vector<Vec3> Au(u.size(), Vec3::Zero()), Afine(fine.size(), Vec3::Zero()), restricted = Au;
        coarse.elastic.addProduct(coarse.tangent, u, Au);
        solid->elastic().addProduct(solid->tangent(), fine, Afine);
        for (std::size_t n = 0; n < fine.size(); ++n)
            for (std::uint32_t parent : coarse.lattice.parents[n]) restricted[parent] += Afine[n] / 2;
        EXPECT_LE(lab::norm(lab::difference(Au, restricted)), kStored * lab::norm(restricted));
    }
}

TEST(CoarseOperator, IsNearTheGalerkinOperatorWhereTheMeanDilatationIsOfLargerCells)
{
    // Mean dilatations over cells of twice the spacing leave less of lambda; observed are .8 to 1.
    const auto [least, largest] =
        energyRatios(*evenlyStretched(lab::asBlock(lab::cutBall({Kind::six, 1, .1}, 7.3)), solver::Volumetric::cell));
    EXPECT_GT(least, .7);
    EXPECT_LT(largest, 1.01);
}

}  // namespace
