// Linear and Green's strain: energy, gradient, tangent and its parts, each against something else that gives the same.
#include "surface_checks.h"

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/solver/corotational.h>
#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace vdbfrac;
using lab::randomVec;
using solver::Strain;
using solver::Volumetric;

namespace {

const solver::Material kGel = solver::makeMaterial(1e5, .3, 1000);

/// S - I, as material.h defines it.
Mat3 strainOf(Strain strain, const Mat3& F)
{
    if (strain == Strain::linear) return 0.5 * (F + F.transpose()) - Mat3::Identity();
    if (strain == Strain::green) return 0.5 * (F.transpose() * F - Mat3::Identity());
    return solver::signedPolar(F).S - Mat3::Identity();
}

double referenceEnergy(const lab::Block& block, const std::vector<Vec3>& x, solver::Elasticity elasticity)
{
    double energy = 0;
    const bool cell = elasticity.volumetric == Volumetric::cell;
    const double theta = elasticity.meanStrain;
    const auto density = [&](const Mat3& F) {
        const Mat3 strain = strainOf(elasticity.strain, F);
        return kGel.mu * strain.squaredNorm() +
               0.5 * (cell ? -2. / 3. * kGel.mu : kGel.lambda) * std::pow(strain.trace(), 2);
    };
    for (const auto& e : block.elements) {
        const auto& tets = tetmesh::cellTets(e.shape);
        double volume = 0, bulk = 0;
        Mat3 mean = Mat3::Zero();
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            Mat3 F = Mat3::Zero();
            for (std::size_t a = 0; a < 4; ++a)
                F += x[e.node[std::size_t(tets.corner[t][a])]] / block.h * Vec3(tets.gradient[t][a].data()).transpose();
            const double V = std::pow(block.h, 3) * tets.volume[t];
            energy += (1 - theta) * V * density(F);
            bulk += V * strainOf(elasticity.strain, F).trace();
            mean += V * F;
            volume += V;
        }
        energy += theta * volume * density(mean / volume);
        if (cell) energy += 0.5 * (kGel.lambda + 2. / 3. * kGel.mu) * bulk * bulk / volume;
    }
    return energy;
}

/// Whether cells average the dilatation, and the share of their mean strain.
using Split = std::pair<Volumetric, double>;
solver::Elasticity splitOf(Strain strain, Split s) { return {s.first, strain, s.second}; }

class StrainCases : public testing::TestWithParam<std::tuple<Strain, Split, tetmesh::Lattice::Kind>> {
protected:
    solver::Elasticity elasticity() const { return splitOf(std::get<0>(GetParam()), std::get<1>(GetParam())); }
    lab::Block block{{6, 5, 4}, 0.1, std::get<2>(GetParam())};
    solver::ElasticOperator elastic = lab::elasticOperator(block, kGel, elasticity());

    std::vector<Vec3> shaken(double size) const { return lab::shaken(block, size, 0, 7).x; }
    std::vector<Vec3> directions(unsigned seed) const
    {
        std::mt19937 random(seed);
        std::vector<Vec3> u;
        for (std::size_t i = 0; i < block.nodes.size(); ++i) u.push_back(randomVec(random, 1));
        return u;
    }
    std::vector<Vec3> gradient(const std::vector<Vec3>& x) const
    {
        std::vector<Vec3> g(x.size(), Vec3::Zero());
        elastic.evaluate(x, g, nullptr);
        return g;
    }
};

TEST_P(StrainCases, EnergyIsThatOfTheStrain)
{
    constexpr double kRounding = 1e-12;
    for (double size : {0.02, 0.3, 1.0}) {
        const auto x = shaken(size);
        const double expected = referenceEnergy(block, x, elasticity());
        EXPECT_NEAR(elastic.evaluate(x, {}, nullptr), expected, kRounding * expected) << size;
    }
}

TEST_P(StrainCases, GradientIsTheDerivativeOfTheEnergy)
{
    const auto x = shaken(0.2), u = directions(5), g = gradient(x);
    const double step = 1e-4 * block.h;
    auto plus = x, minus = x;
    for (std::size_t i = 0; i < x.size(); ++i) plus[i] += step * u[i], minus[i] -= step * u[i];
    const double slope = (elastic.evaluate(plus, {}, nullptr) - elastic.evaluate(minus, {}, nullptr)) / (2 * step);
    // Step^2, and rounding over it.
    EXPECT_NEAR(slope, solver::dot(g, u), 1e-7 * std::sqrt(solver::dot(g, g) * solver::dot(u, u)));
}

TEST_P(StrainCases, ProductIsTheDerivativeOfTheGradient)
{
    const auto x = shaken(0.15), u = directions(5);
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    const double step = 1e-5 * block.h;
    auto plus = x, minus = x;
    for (std::size_t i = 0; i < x.size(); ++i) plus[i] += step * u[i], minus[i] -= step * u[i];
    const auto up = gradient(plus), down = gradient(minus);
    std::vector<Vec3> Ku(x.size(), Vec3::Zero());
    elastic.addProduct(tangent, u, Ku);
    double error = 0;
    for (std::size_t i = 0; i < x.size(); ++i) error += (Ku[i] - (up[i] - down[i]) / (2 * step)).squaredNorm();
    EXPECT_LT(std::sqrt(error / solver::dot(Ku, Ku)), 1e-6);  // the tangent is kept in single precision
}

void expectDiagonalAndElementsOfTheProduct(const solver::ElasticOperator& elastic, const lab::Block& block,
                                           const solver::Tangent& tangent, const std::vector<Vec3>& u)
{
    constexpr double kStored = 1e-6;  // single precision
    const auto blocks = lab::diagonalBlocks(elastic, tangent);
    std::vector<Vec3> Ku(u.size(), Vec3::Zero()), summed = Ku;
    elastic.addProduct(tangent, u, Ku);
    std::vector<Mat3> diagonal(u.size(), Mat3::Zero());
    for (std::size_t e = 0; e < block.elements.size(); ++e) {
        const auto K = elastic.elementMatrix(tangent, e);
        for (int i = 0; i < 8; ++i) {
            diagonal[block.elements[e].node[std::size_t(i)]] += K.block<3, 3>(3 * i, 3 * i);
            for (int j = 0; j < 8; ++j)
                summed[block.elements[e].node[std::size_t(i)]] +=
                    K.block<3, 3>(3 * i, 3 * j) * u[block.elements[e].node[std::size_t(j)]];
        }
    }
    for (std::size_t i = 0; i < u.size(); ++i) {
        EXPECT_LT((blocks[i] - diagonal[i]).norm(), kStored * diagonal[i].norm());
        EXPECT_LT((Ku[i] - summed[i]).norm(), kStored * diagonal[i].norm());
    }
}

TEST_P(StrainCases, DiagonalBlocksAndElementMatricesAreThoseOfTheProduct)
{
    solver::Tangent tangent, cells;
    elastic.evaluate(shaken(0.15), {}, &tangent, 0.3);
    elastic.averageTets(tangent, cells);
    for (const auto* t : {&tangent, &cells}) expectDiagonalAndElementsOfTheProduct(elastic, block, *t, directions(3));
}

/// On a ball, whose surface cuts cells. Both deformations stretch so much that all tangents are definite. With a share
/// of mean strain only where u deforms the tets of a cell alike too: one twist operator cannot be that of both shares.
TEST_P(StrainCases, MeansOverCellsAreTheTangentWhereTheTetsOfACellDeformAlike)
{
    constexpr double kStored = 2e-6;  // single precision, R T R^T of it
    const lab::Block ball = lab::asBlock(lab::cutBall({std::get<2>(GetParam()), 1, .1}, 4.3));
    const auto elastic = lab::elasticOperator(ball, kGel, elasticity());
    const Mat3 turn = Eigen::AngleAxisd(.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    std::mt19937 random(3);
    std::vector<Vec3> u;
    const Mat3 gradient = Mat3::NullaryExpr([&] { return std::uniform_real_distribution<>(-1, 1)(random); });
    for (const Coord& c : ball.nodes)
        u.push_back(elasticity().meanStrain > 0 ? Vec3(gradient * (ball.h * c.toVec())) : randomVec(random, 1));
    for (const Vec3& stretch : {Vec3(1.2, 1.1, 1.05), Vec3(5, 1.5, 2)}) {
        std::vector<Vec3> x, Ku(u.size(), Vec3::Zero()), mean = Ku;
        for (Coord c : ball.nodes) x.push_back(turn * stretch.asDiagonal() * (ball.h * c.toVec()));
        solver::Tangent tangent, cells;
        elastic.evaluate(x, {}, &tangent, .3);
        elastic.averageTets(tangent, cells);
        elastic.addProduct(tangent, u, Ku);
        elastic.addProduct(cells, u, mean);
        double difference = 0;
        for (std::size_t i = 0; i < u.size(); ++i) difference += (Ku[i] - mean[i]).squaredNorm();
        EXPECT_LT(difference, kStored * kStored * solver::dot(Ku, Ku)) << stretch.transpose();
    }
}

/// Smallest eigenvalue of any element matrix, over the largest of all.
double minEigenvalue(const solver::ElasticOperator& elastic, const solver::Tangent& tangent, std::size_t elements)
{
    double least = 0, largest = 0;
    for (std::size_t e = 0; e < elements; ++e) {
        const Eigen::SelfAdjointEigenSolver<solver::ElasticOperator::ElementMatrix> eigen(
            elastic.elementMatrix(tangent, e));
        least = std::min(least, eigen.eigenvalues().minCoeff());
        largest = std::max(largest, eigen.eigenvalues().maxCoeff());
    }
    return least / largest;
}

/// Also where most tets are inside out and their rotations have no mean.
TEST_P(StrainCases, MeansOverCellsAreSemidefinite)
{
    constexpr double kStored = 1e-6;  // single precision
    for (double size : {0.2, 1.0}) {
        auto x = shaken(size);
        for (Vec3& point : x) point *= 0.7;
        solver::Tangent tangent, cells;
        elastic.evaluate(x, {}, &tangent, 0.3);
        elastic.averageTets(tangent, cells);
        EXPECT_GT(minEigenvalue(elastic, cells, block.elements.size()), -kStored) << size;
    }
}

/// Where the tets of a cell differ, what is asked of a preconditioner: bounds of u.K u over that with the means.
TEST_P(StrainCases, MeansOverCellsAreNearTheTangent)
{
    solver::Tangent tangent, cells;
    elastic.evaluate(shaken(0.1), {}, &tangent);
    elastic.averageTets(tangent, cells);
    for (unsigned seed = 1; seed < 20; ++seed) {
        const auto u = directions(seed);
        const double ratio = elastic.multiply<Vec3>(tangent, u).energy / elastic.multiply<Vec3>(cells, u).energy;
        EXPECT_GT(ratio, .9);
        EXPECT_LT(ratio, 1.1);
    }
}

TEST_P(StrainCases, ProjectedAndWarpedTangentsAreSemidefinite)
{
    constexpr double kStored = 1e-6, kClearly = 1e-2;  // single precision
    auto x = shaken(0.2);
    for (Vec3& point : x) point *= 0.5;
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    if (elasticity().strain == Strain::green) {
        EXPECT_LT(minEigenvalue(elastic, tangent, block.elements.size()), -kClearly);
    }
    elastic.project(tangent);
    EXPECT_GT(minEigenvalue(elastic, tangent, block.elements.size()), -kStored);
    elastic.evaluate(x, {}, &tangent);
    elastic.warp(tangent);
    EXPECT_GT(minEigenvalue(elastic, tangent, block.elements.size()), -kStored);
}

TEST_P(StrainCases, AllLinearSolversAgree)
{
    constexpr double kTight = 1e-10, kAgree = 1e-5;  // the tangent in single precision is the same for all
    const auto x = shaken(0.02);
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    std::vector<std::uint8_t> fixed;
    for (const Coord& c : block.nodes) fixed.push_back(c.z == 0);
    const solver::LinearSystem system{elastic, tangent, 1e3, fixed};
    const auto b = directions(9);
    std::vector<std::vector<Vec3>> results;
    for (const auto method :
         {solver::LinearMethod::direct, solver::LinearMethod::jacobi, solver::LinearMethod::multigrid}) {
        solver::LinearSolver linear(elastic, method, solver::LinearPrecision::doubles);
        std::vector<Vec3> u(x.size());
        EXPECT_EQ(linear.solve(system, b, u, {kTight, 5000}).status, solver::LinearStatus::converged);
        results.push_back(u);
    }
    for (std::size_t k = 1; k < results.size(); ++k) {
        double off = 0;
        for (std::size_t i = 0; i < x.size(); ++i) off += (results[k][i] - results[0][i]).squaredNorm();
        EXPECT_LT(std::sqrt(off / solver::dot(results[0], results[0])), kAgree);
    }
}

INSTANTIATE_TEST_SUITE_P(Strains, StrainCases,
                         testing::Combine(testing::Values(Strain::corotational, Strain::linear, Strain::green),
                                          testing::Values(Split{Volumetric::none, 0}, Split{Volumetric::cell, 0},
                                                          Split{Volumetric::cell, .75}),
                                          testing::Values(tetmesh::Lattice::Kind::six, tetmesh::Lattice::Kind::five)));

/// Stress over E that a rigid turn about z brings forth: force on one face over its area and E.
double stressOfTurn(Strain strain, double degrees)
{
    const lab::Block block({4, 4, 4}, 0.25);
    const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1, .3, 1), {Volumetric::cell, strain});
    const Mat3 R = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3::UnitZ()).toRotationMatrix();
    std::vector<Vec3> x, g(block.nodes.size(), Vec3::Zero());
    for (const Vec3& X : block.restPositions()) x.push_back(R * X);
    elastic.evaluate(x, g, nullptr);
    Vec3 force = Vec3::Zero();
    for (std::size_t i = 0; i < g.size(); ++i)
        if (block.nodes[i].x == 4) force += g[i];
    return std::abs(force.x());
}

TEST(Strains, OnlyTheLinearOneSeesATurn)
{
    constexpr double kRounding = 1e-13;
    EXPECT_LE(stressOfTurn(Strain::corotational, 10), kRounding);
    EXPECT_LE(stressOfTurn(Strain::green, 10), kRounding);
    // e = (cos 10 - 1)(xx + yy), free of zz: stress (2 mu + 2 lambda) e.
    const solver::Material m = solver::makeMaterial(1, .3, 1);
    const double expected = (2 * m.mu + 2 * m.lambda) * (1 - std::cos(10 * std::numbers::pi / 180));
    EXPECT_NEAR(stressOfTurn(Strain::linear, 10), expected, 1e-12);
}

/// P11 of a bar with nu = 0 at stretch s: E (s - 1), and of Green's strain E s (s^2 - 1) / 2.
TEST(Strains, UniaxialStressIsThatOfTheClosedForm)
{
    for (const Strain strain : {Strain::corotational, Strain::linear, Strain::green})
        for (const double s : {0.7, 1.0, 1.5}) {
            const lab::Block block({4, 4, 4}, 0.25);
            const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1, 0, 1), {Volumetric::cell, strain});
            std::vector<Vec3> x, g(block.nodes.size(), Vec3::Zero());
            for (const Vec3& X : block.restPositions()) x.emplace_back(s * X.x(), X.y(), X.z());
            elastic.evaluate(x, g, nullptr);
            double force = 0;
            for (std::size_t i = 0; i < g.size(); ++i)
                if (block.nodes[i].x == 4) force += g[i].x();
            EXPECT_NEAR(force, strain == Strain::green ? s * (s * s - 1) / 2 : s - 1, 1e-12);
        }
}

}  // namespace
