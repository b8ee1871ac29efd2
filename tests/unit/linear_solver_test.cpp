// The linear solvers against the element matrices, against each other, and where a system is not definite.
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include "case.h"

#include <vdbfrac/lab/samples/crack.h>
#include <vdbfrac/lab/samples/solid.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <ostream>
#include <string>

using namespace vdbfrac;
using lab::Block;
using lab::kGel;
using lab::makeSolid;
using lab::onFloor;
using lab::Solid;
using solver::LinearMethod;
using solver::LinearStatus;
using solver::Volumetric;
using Kind = tetmesh::Lattice::Kind;

namespace {

using Case = test::Case<std::unique_ptr<Solid>>;
constexpr auto nameOf = test::nameOf<std::unique_ptr<Solid>>;

class Operators : public testing::TestWithParam<Case> {};

TEST_P(Operators, ElementMatricesAddUpToTheProduct)
{
    constexpr double kRounding = 1e-14;  // of what is added up: some hundred roundings of a double
    const auto solid = GetParam().make();
    const auto& elastic = solid->elastic();
    const std::size_t n = solid->nodeCount();
    const std::vector<Vec3> u = solid->randomForces(3);
    std::vector<Vec3> Ku(n, Vec3::Zero()), sum(n, Vec3::Zero());
    elastic.addProduct(solid->tangent(), u, Ku);
    std::vector<double> size(n, 0);
    std::size_t number = 0;
    for (const auto& set : elastic.sets())
        for (const auto& e : set.elements) {
            const auto K = elastic.elementMatrix(solid->tangent(), number++);
            ASSERT_LT((K - K.transpose()).norm(), kRounding * K.norm());
            for (std::size_t a = 0; a < 8; ++a)
                for (std::size_t b = 0; b < 8; ++b) {
                    const std::size_t row = set.firstNode + e.node[a], column = set.firstNode + e.node[b];
                    const Mat3 block = K.block<3, 3>(Eigen::Index(3 * a), Eigen::Index(3 * b));
                    sum[row] += block * u[column];
                    size[row] += block.norm() * u[column].norm();
                }
        }
    for (std::size_t i = 0; i < n; ++i) EXPECT_LE((sum[i] - Ku[i]).norm(), kRounding * size[i]) << i;
}

TEST_P(Operators, MultiplyReturnsTheEnergyOfTheProduct)
{
    constexpr double kRounding = 1e-13;  // of sum |u| |K u|: sums over all nodes
    const auto solid = GetParam().make();
    const std::vector<Vec3> u = solid->randomForces(3);
    std::vector<Vec3> Ku(u.size(), Vec3::Zero());
    solid->elastic().addProduct(solid->tangent(), u, Ku);
    double energy = 0, size = 0;
    for (std::size_t i = 0; i < u.size(); ++i) energy += u[i].dot(Ku[i]), size += u[i].norm() * Ku[i].norm();
    EXPECT_NEAR(solid->elastic().multiply<Vec3>(solid->tangent(), u).energy, energy, kRounding * size);
}

TEST_P(Operators, SinglePrecisionProductIsTheDoubleOneRounded)
{
    constexpr double kSingle = 30 * 6e-8;  // some thirty roundings of a float
    const auto solid = GetParam().make();
    const std::vector<Vec3> u = solid->randomForces(3);
    std::vector<Eigen::Vector3f> single;
    for (const Vec3& v : u) single.push_back(v.cast<float>());
    std::vector<Vec3> Ku(u.size(), Vec3::Zero());
    solid->elastic().addProduct(solid->tangent(), u, Ku);
    const double energy = solid->elastic().multiply<Vec3>(solid->tangent(), u).energy;
    const auto [singleEnergy, sums] = solid->elastic().multiply<solver::Vec3f>(solid->tangent(), single);
    double error = 0;
    for (std::size_t i = 0; i < u.size(); ++i) error += (sums(i).cast<double>() - Ku[i]).squaredNorm();
    EXPECT_LE(std::sqrt(error), kSingle * lab::norm(Ku));
    EXPECT_NEAR(singleEnergy, energy, kSingle * lab::norm(u) * lab::norm(Ku));
}

Case operatorCase(const char* name, Kind kind, Volumetric volumetric, double share = 0)
{
    return {name, [=] {
                const tetmesh::Lattice lattice{kind, 1, .1};
                Solid::Conditions conditions{
                    .held = [](Coord) { return false; }, .volumetric = volumetric, .share = share, .shake = .15};
                return makeSolid(lab::asBlock(lab::cutBall(lattice, 4.3)), conditions);
            }};
}

INSTANTIATE_TEST_SUITE_P(CutBall, Operators,
                         testing::Values(operatorCase("six", Kind::six, Volumetric::none),
                                         operatorCase("sixByCell", Kind::six, Volumetric::cell),
                                         operatorCase("five", Kind::five, Volumetric::none),
                                         operatorCase("fiveByCell", Kind::five, Volumetric::cell),
                                         operatorCase("damped", Kind::six, Volumetric::cell, .4),
                                         operatorCase("dampedPlain", Kind::six, Volumetric::none, .4)),
                         nameOf);

class Solvers : public testing::TestWithParam<Case> {};

/// Solution by a method; it must have converged by that method.
std::vector<Vec3> solved(const Solid& solid, LinearMethod method, std::span<const Vec3> b, solver::LinearLimits limits)
{
    solver::LinearSolver linear(solid.elastic(), method);
    std::vector<Vec3> u(b.size(), Vec3::Ones());
    const auto report = linear.solve(solid.system(), b, u, limits);
    EXPECT_EQ(report.status, LinearStatus::converged) << report.iterations;
    EXPECT_EQ(report.method, method);
    for (std::size_t i = 0; i < u.size(); ++i) {
        if (!solid.fixed()[i]) continue;
        EXPECT_EQ(u[i], Vec3::Zero());
    }
    return u;
}

TEST_P(Solvers, DirectMethodLeavesOnlyRounding)
{
    constexpr double kBackward = 1e-14;  // of |A| |u|: backward stability of a Cholesky factorisation
    const auto solid = GetParam().make();
    const std::vector<Vec3> b = solid->randomForces(5);
    const std::vector<Vec3> u = solved(*solid, LinearMethod::direct, b, {});
    double size = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        const double diagonal =
            solid->elastic().stiffness()[i] + solid->system().massFactor * solid->elastic().mass()[i];
        size += (diagonal * diagonal) * u[i].squaredNorm();
    }
    EXPECT_LE(lab::norm(lab::difference(b, solid->product(u))), kBackward * std::sqrt(size));
}

double inNormOfA(const Solid& solid, std::span<const Vec3> u) { return std::sqrt(solver::dot(u, solid.product(u))); }

TEST_P(Solvers, AllMethodsAgree)
{
    // An error in the norm of A is at most the residual in the norm of the preconditioner B times the root of the
    // condition of B A, which is below 1e3 here by the iterations that jacobi takes, and smaller with multigrid.
    constexpr double kTolerance = 1e-9, kError = 32 * kTolerance;
    const auto solid = GetParam().make();
    const std::vector<Vec3> b = solid->randomForces(5);
    const std::vector<Vec3> exact = solved(*solid, LinearMethod::direct, b, {});
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        const std::vector<Vec3> error = lab::difference(solved(*solid, method, b, {kTolerance, 50000}), exact);
        EXPECT_LE(inNormOfA(*solid, error), kError * inNormOfA(*solid, exact)) << int(method);
        EXPECT_LE(lab::norm(error), kError * lab::norm(exact)) << int(method);
    }
}

/// More nodes than the coarsest level of multigrid takes, and a size that does not halve.
Block bar(Kind kind = Kind::six) { return Block({7, 8, 9}, .1, kind); }

std::unique_ptr<Solid> twoBodies()
{
    Block other({6, 6, 9}, .1);
    for (Coord& c : other.nodes) c.x += 10;
    return std::make_unique<Solid>(
        std::vector<Solid::Body>{{bar(), kGel}, {std::move(other), solver::makeMaterial(1e7, .45, 3000)}},
        Solid::Conditions{.held = onFloor});
}

std::unique_ptr<Solid> twoFragments()
{
    Block block = bar();
    lab::openCrack(block, {&Coord::z, 5}, [](Coord) { return true; });
    return makeSolid(std::move(block), {.held = onFloor, .massFactor = 100});
}

/// A ball slit along two thirds of its equator: cut cells, and nodes of either lip at the same place.
std::unique_ptr<Solid> slitBall()
{
    const tetmesh::Lattice lattice{Kind::six, 1, .1};
    const auto phi = [](Vec3 p) { return std::max(p.norm() - .53, std::min(.03 - std::abs(p.z()), .2 - p.x())); };
    const tetmesh::CutMesh mesh(lattice, lab::sample({-6, -6, -6}, {6, 6, 6}, .1, phi));
    return makeSolid(lab::asBlock(mesh), {.held = [](Coord c) { return c.z < -3; }});
}

/// Nodes displaced by up to half a spacing: tets inverted, no two rotations alike, and no negative curvature only
/// because the tangent is projected.
std::unique_ptr<Solid> scrambled()
{
    auto solid = makeSolid(bar(), {.held = onFloor, .massFactor = 100, .stretch = 1, .shake = .5});
    solid->elastic().project(solid->tangent());
    return solid;
}

/// Held at four nodes, none of which stands on a node of a coarser lattice.
std::unique_ptr<Solid> oddNodesHeld()
{
    const auto held = [](Coord c) {
        return c == Coord{1, 1, 1} || c == Coord{5, 1, 3} || c == Coord{3, 5, 1} || c == Coord{5, 7, 7};
    };
    return makeSolid(bar(), {.held = held});
}

INSTANTIATE_TEST_SUITE_P(
    Systems, Solvers,
    testing::Values(Case{"block", [] { return makeSolid(bar(), {.held = onFloor}); }},
                    Case{"shortStep", [] { return makeSolid(bar(), {.held = onFloor, .massFactor = 1e6}); }},
                    Case{"cutBall",
                         [] {
                             const tetmesh::Lattice lattice{Kind::six, 1, .1};
                             return makeSolid(lab::asBlock(lab::cutBall(lattice, 5.3)),
                                              {.held = [](Coord c) { return c.z < -3; }});
                         }},
                    Case{"five", [] { return makeSolid(bar(Kind::five), {.held = onFloor}); }},
                    Case{"twoBodies", twoBodies},
                    Case{"nearlyIncompressible",
                         [] { return makeSolid(bar(), {.held = onFloor}, solver::makeMaterial(1e5, .49, 1000)); }},
                    Case{"slitBall", slitBall}, Case{"scrambled", scrambled}, Case{"oddNodesHeld", oddNodesHeld},
                    Case{"twoFragments", twoFragments},
                    Case{"damped", [] { return makeSolid(bar(), {.held = onFloor, .massFactor = 100, .share = .5}); }}),
    nameOf);

const LinearMethod kMethods[] = {LinearMethod::jacobi, LinearMethod::multigrid, LinearMethod::direct};

/// Squeezed to a third: every tet's tangent has negative twist eigenvalues.
std::unique_ptr<Solid> squeezed() { return makeSolid(bar(), {.held = onFloor, .stretch = 1. / 3}); }

bool finite(const std::vector<Vec3>& u)
{
    bool all = true;
    for (const Vec3& v : u) all = all && v.allFinite();
    return all;
}

TEST(LinearSolver, NegativeCurvatureIsReportedNotFollowed)
{
    const auto solid = squeezed();
    const std::vector<Vec3> b = solid->randomForces(5);
    for (LinearMethod method : kMethods) {
        solver::LinearSolver linear(solid->elastic(), method);
        std::vector<Vec3> u(b.size(), Vec3::Ones());
        const auto report = linear.solve(solid->system(), b, u, {1e-6, 50000});
        EXPECT_EQ(report.status, LinearStatus::negativeCurvature) << int(method);
        EXPECT_TRUE(finite(u));
        EXPECT_GE(solver::dot(u, b), 0);  // what was found before still descends
    }
}

TEST(LinearSolver, ProjectedTangentIsSolvedByEveryMethod)
{
    constexpr double kTolerance = 1e-8, kError = 32 * kTolerance;  // as in AllMethodsAgree
    const auto solid = squeezed();
    solid->elastic().project(solid->tangent());
    const std::vector<Vec3> b = solid->randomForces(5);
    const std::vector<Vec3> exact = solved(*solid, LinearMethod::direct, b, {});
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        const std::vector<Vec3> error = lab::difference(solved(*solid, method, b, {kTolerance, 50000}), exact);
        EXPECT_LE(inNormOfA(*solid, error), kError * inNormOfA(*solid, exact)) << int(method);
    }
}

/// A solver that met an indefinite matrix solves the next one as a new solver does.
TEST(LinearSolver, KeepsNothingOfAFailedSystem)
{
    const auto solid = squeezed();
    const std::vector<Vec3> b = solid->randomForces(5);
    for (LinearMethod method : kMethods) {
        const auto fresh = squeezed();
        solver::LinearSolver linear(fresh->elastic(), method);
        std::vector<Vec3> u(b.size());
        (void)linear.solve(fresh->system(), b, u, {1e-6, 50000});
        fresh->elastic().project(fresh->tangent());
        EXPECT_EQ(linear.solve(fresh->system(), b, u, {1e-6, 50000}).status, LinearStatus::converged);
        const auto other = squeezed();
        other->elastic().project(other->tangent());
        EXPECT_EQ(u, solved(*other, method, b, {1e-6, 50000})) << int(method);
    }
}

/// CHOLMOD reports an indefinite matrix on stdout unless cholmod().print is 0.
TEST(LinearSolver, PrintsNothing)
{
    const auto solid = squeezed();
    const std::vector<Vec3> b = solid->randomForces(5);
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    for (LinearMethod method : kMethods) {
        solver::LinearSolver linear(solid->elastic(), method);
        std::vector<Vec3> u(b.size());
        (void)linear.solve(solid->system(), b, u, {1e-6, 50000});
    }
    std::fflush(stdout);
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(LinearSolver, CapIsReportedAndKept)
{
    const auto solid = makeSolid(bar(), {.held = onFloor});
    const std::vector<Vec3> b = solid->randomForces(5);
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        solver::LinearSolver linear(solid->elastic(), method);
        std::vector<Vec3> u(b.size());
        const auto report = linear.solve(solid->system(), b, u, {1e-12, 3});
        EXPECT_EQ(report.status, LinearStatus::capped);
        EXPECT_EQ(report.iterations, 3);
        EXPECT_GT(solver::dot(u, b), 0);
    }
}

TEST(LinearSolver, NoForceNeedsNoIteration)
{
    const auto solid = makeSolid(bar(), {.held = onFloor});
    const std::vector<Vec3> zero(solid->nodeCount(), Vec3::Zero());
    for (LinearMethod method : kMethods) {
        solver::LinearSolver linear(solid->elastic(), method);
        std::vector<Vec3> u(zero.size(), Vec3::Ones());
        EXPECT_EQ(linear.solve(solid->system(), zero, u, {1e-9, 10}).status, LinearStatus::converged);
        EXPECT_EQ(u, zero);
    }
}

TEST(LinearSolver, SameBitsForAnyNumberOfThreads)
{
    Block block({21, 17, 19}, .05);  // several patches, several chunks of nodes
    lab::openCrack(block, {&Coord::z, 9}, [](Coord c) { return c.x < 10; });
    const auto solid = makeSolid(std::move(block), {.held = onFloor});
    const std::vector<Vec3> b = solid->randomForces(5);
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        std::uint64_t first = 0;
        for (int threads : {1, 2, 3}) {
            const ThreadLimit limit(threads);
            const std::vector<Vec3> u = solved(*solid, method, b, {1e-5, 5000});
            const std::uint64_t hash = hashOf(std::span<const Vec3>(u));
            if (threads == 1) first = hash;
            EXPECT_EQ(hash, first) << int(method) << ", " << threads << " threads";
        }
    }
}

}  // namespace
