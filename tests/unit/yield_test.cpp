// Material that yields: its capped potential, what it leaves of the tangent, and its strain, against plain code,
// differences and closed forms.
#include <flowed_body.h>

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/solver/element.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>

using namespace vdbfrac;
using lab::Body;
using lab::kBallGel;
using lab::Shape;
using solver::Strain;
using solver::Volumetric;

namespace {

class YieldCases : public testing::TestWithParam<std::tuple<Strain, std::pair<Volumetric, double>, Shape>> {
protected:
    solver::Elasticity elasticity() const
    {
        const auto [volumetric, meanStrain] = std::get<1>(GetParam());
        return {volumetric, std::get<0>(GetParam()), meanStrain};
    }
    Body body{std::get<2>(GetParam())};
    solver::ElasticOperator elastic = body.elastic(body.yieldingSet(), elasticity());
    solver::ElementOf element(std::size_t e) const
    {
        solver::ElementOf of = body.element(e);
        of.yieldStrain = body.yield.strain[e], of.yieldShare = body.yield.share;
        return of;
    }
    /// Elements that yield at x, and those that do not.
    std::pair<std::size_t, std::size_t> counts(const std::vector<Vec3>& x) const
    {
        std::vector<double> n;
        elastic.shearStrains(x, n);
        std::size_t yielding = 0;
        for (std::size_t e = 0; e < n.size(); ++e) yielding += n[e] > body.yield.strain[e];
        return {yielding, n.size() - yielding};
    }
};

TEST_P(YieldCases, EnergyEqualsScalarReference)
{
    constexpr double kRounding = 1e-12;
    for (double size : {0.01, 0.3}) {
        const auto x = body.shaken(size);
        double expected = 0, elastic = 0;
        for (std::size_t e = 0; e < body.block.elements.size(); ++e) {
            expected += solver::elasticEnergy(element(e), x, kBallGel, elasticity());
            elastic += solver::elasticEnergy(body.element(e), x, kBallGel, elasticity());
        }
        EXPECT_NEAR(this->elastic.evaluate(x, {}, nullptr), expected, kRounding * expected) << size;
        EXPECT_LT(expected, (1 - 1e-3) * elastic);
        EXPECT_GT(std::min(counts(x).first, counts(x).second), body.block.elements.size() / 10);
    }
}

/// mu n^2 and K / 2 of the mean dilatation are all that a body stores: n from the energies of two materials.
TEST_P(YieldCases, ShearStrainIsTheRootOfTheShearEnergy)
{
    constexpr double kRounding = 1e-9;
    const auto x = body.shaken(.1);
    std::vector<double> n;
    elastic.shearStrains(x, n);
    const solver::Material stiffer{2 * kBallGel.mu, kBallGel.lambda - 2. / 3 * kBallGel.mu,
                                   kBallGel.rho};  // the same bulk modulus
    const double h3 = std::pow(body.block.h, 3);
    for (std::size_t e = 0; e < n.size(); ++e) {
        double volume = 0;
        const tetmesh::CellElement& cell = body.block.elements[e];
        for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t)
            volume += h3 * tetmesh::cellTets(cell.shape).volume[t] * cell.fraction[t] *
                      double(body.stiffness[tetmesh::tetEntry(e, t)]);
        const double energy = solver::elasticEnergy(body.element(e), x, kBallGel, elasticity()),
                     more = solver::elasticEnergy(body.element(e), x, stiffer, elasticity()) - energy;
        EXPECT_NEAR(n[e] * n[e] * kBallGel.mu * volume, more, kRounding * (more + energy)) << e;
    }
}

TEST_P(YieldCases, GradientIsTheDerivativeOfTheEnergy)
{
    // Step^2, and elements that begin to yield within it.
    EXPECT_LT(lab::errorOfGradient(elastic, body.shaken(0.1), body.random(1, 5), 1e-4 * body.block.h), 1e-6);
}

/// But for elements that begin to yield within the step of the differences.
TEST_P(YieldCases, ProductIsTheDerivativeOfTheGradient)
{
    EXPECT_LT(lab::errorOfProduct(elastic, body.shaken(0.1), body.random(1, 5), 1e-6 * body.block.h), 1e-5);
}

TEST_P(YieldCases, DiagonalBlocksAndElementMatricesAreThoseOfTheProduct)
{
    lab::expectPartsOfTheProduct(elastic, body);
}

/// Projected: as steps are solved. Means, which precondition, are no softer along any way than that.
TEST_P(YieldCases, ProjectedTangentsAreSemidefinite)
{
    constexpr double kStored = 1e-6;  // single precision
    solver::Tangent tangent;
    elastic.evaluate(body.shaken(0.3), {}, &tangent);
    elastic.project(tangent);
    for (std::size_t e = 0; e < body.block.elements.size(); e += 3) {
        const auto K = elastic.elementMatrix(tangent, e);
        const Eigen::SelfAdjointEigenSolver<solver::ElasticOperator::ElementMatrix> eigen(K, Eigen::EigenvaluesOnly);
        EXPECT_GT(eigen.eigenvalues()[0], -kStored * eigen.eigenvalues()[23]) << e;
    }
}

TEST_P(YieldCases, WhatNeverYieldsHasTheBitsOfWhatCannot)
{
    const auto x = body.shaken(0.2), u = body.random(1, 3);
    solver::Yield far{1e300, {}, 1};
    solver::ElementSet set = body.set();
    set.yield = &far;
    const auto with = body.elastic(set, elasticity()), without = body.elastic(elasticity());
    const auto of = [&](const solver::ElasticOperator& elastic) {
        std::vector<Vec3> g(x.size(), Vec3::Zero()), Ku = g;
        solver::Tangent tangent;
        const double energy = elastic.evaluate(x, g, &tangent, .2);
        elastic.project(tangent);
        elastic.addProduct(tangent, u, Ku);
        return std::tuple(energy, g, Ku);
    };
    EXPECT_EQ(of(with), of(without));
}

INSTANTIATE_TEST_SUITE_P(Laws, YieldCases,
                         testing::Combine(testing::Values(Strain::corotational, Strain::linear, Strain::green),
                                          testing::Values(std::pair{Volumetric::none, 0.},
                                                          std::pair{Volumetric::cell, 0.},
                                                          std::pair{Volumetric::cell, .75}),
                                          testing::Values(Shape::six, Shape::five, Shape::tets)));

/// Stretched alike everywhere: the shear stress that is left, 2 mu n, is that of the law.
TEST(Yield, StressIsThatOfTheLaw)
{
    constexpr double kRounding = 1e-9, kStrain = .02;
    lab::Body body(Shape::six);
    for (const auto& [share, expected] : {std::pair(1., .02), std::pair(.25, .02 + .75 * (.05 - .02))}) {
        solver::Yield yield{kStrain, {}, share};
        solver::ElementSet set{body.block.elements, body.block.nodes, 0, kBallGel};
        set.yield = &yield;
        const auto elastic = body.elastic(set, {Volumetric::cell, Strain::corotational, .75});
        // |dev e| = .05, no change of volume: the energy over the volume is that of a bar, its slope along it the
        // stress
        const auto density = [&](double n) {
            std::vector<Vec3> x;
            const Vec3 e = n / std::sqrt(6.) * Vec3(2, -1, -1);
            for (const Coord& c : body.block.nodes)
                x.push_back(body.block.h * (Vec3::Ones() + e).cwiseProduct(c.toVec()));
            double mass = 0;
            for (const double m : elastic.mass()) mass += m;
            return elastic.evaluate(x, {}, nullptr) / (mass / kBallGel.rho);
        };
        const double step = 1e-6, slope = (density(.05 + step) - density(.05 - step)) / (2 * step);
        EXPECT_NEAR(slope, 2 * kBallGel.mu * expected, kRounding * kBallGel.youngsModulus()) << share;
    }
}

}  // namespace
