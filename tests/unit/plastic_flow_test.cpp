// Plastic flow and stiffness of each tet: energy, gradient, tangent and its parts, each against something else that
// gives the same.
#include <flowed_body.h>

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/solver/element.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>

using namespace vdbfrac;
using lab::Body;
using lab::kBallGel;
using lab::randomFlow;
using lab::Shape;
using solver::Strain;
using solver::Volumetric;

namespace {

class FlowCases : public testing::TestWithParam<std::tuple<Strain, std::pair<Volumetric, double>, Shape>> {
protected:
    solver::Elasticity elasticity() const
    {
        const auto [volumetric, meanStrain] = std::get<1>(GetParam());
        return {volumetric, std::get<0>(GetParam()), meanStrain};
    }
    Body body{std::get<2>(GetParam())};
    solver::ElasticOperator elastic = body.elastic(elasticity());
};

TEST_P(FlowCases, EnergyEqualsScalarReference)
{
    constexpr double kRounding = 1e-12;
    for (double size : {0.02, 0.3}) {
        const auto x = body.shaken(size);
        double expected = 0;
        for (std::size_t e = 0; e < body.block.elements.size(); ++e)
            expected += solver::elasticEnergy(body.element(e), x, kBallGel, elasticity());
        EXPECT_NEAR(elastic.evaluate(x, {}, nullptr), expected, kRounding * expected) << size;
    }
}

/// At small strains: the forces are those of the energy, by central differences. Tets without material have none.
TEST_P(FlowCases, StressDoesTheWorkOfTheForces)
{
    constexpr double kSmall = 1e-6, kOrder = 1e-4;  // strain; relative, next order in it and differences
    std::vector<Vec3> x = body.shaken(kSmall);
    for (std::size_t i = 0; i < body.block.elements.size(); i += 7) {
        solver::ElementOf e = body.element(i);
        e.inverseFlow = nullptr;
        const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
        const auto stress = solver::elementStress(e, x, kBallGel, elasticity());
        std::map<std::uint32_t, Vec3> forces;
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            if (e.element.fraction[t] == 0) continue;
            std::array<Vec3, 4> gradient;
            for (std::size_t a = 1; a < 4; ++a)
                gradient[a] =
                    Eigen::Map<const Vec3>(e.gradients ? (*e.gradients)[a - 1].data() : tets.gradient[t][a].data());
            gradient[0] = -(gradient[1] + gradient[2] + gradient[3]);
            for (std::size_t a = 0; a < 4; ++a)
                forces.try_emplace(e.element.node[std::size_t(tets.corner[t][a])], Vec3::Zero()).first->second +=
                    e.h * e.h * tets.volume[t] * e.element.fraction[t] * stress[t] * gradient[a];
        }
        double most = 0;
        for (const auto& [node, force] : forces) most = std::max(most, force.norm());
        for (const auto& [node, force] : forces)
            for (int k = 0; k < 3; ++k) {
                const double step = kSmall * e.h, at = x[node][k];
                x[node][k] = at + step;
                const double above = solver::elasticEnergy(e, x, kBallGel, elasticity());
                x[node][k] = at - step;
                const double below = solver::elasticEnergy(e, x, kBallGel, elasticity());
                x[node][k] = at;
                EXPECT_NEAR(force[k], (above - below) / (2 * step), kOrder * most) << i;
            }
    }
}

TEST_P(FlowCases, StressTurnsWithTheMaterial)
{
    constexpr double kRounding = 1e-10;                 // of polar decompositions
    if (elasticity().strain == Strain::linear) return;  // not for turns
    const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(1, -2, .5).normalized()).toRotationMatrix();
    const std::vector<Vec3> x = body.shaken(.2);
    std::vector<Vec3> turned = x;
    for (Vec3& p : turned) p = turn * p + Vec3(1, 2, 3);
    for (std::size_t i = 0; i < body.block.elements.size(); ++i) {
        const solver::ElementOf e = body.element(i);
        const auto before = solver::elementStress(e, x, kBallGel, elasticity()),
                   after = solver::elementStress(e, turned, kBallGel, elasticity());
        for (std::size_t t = 0; t < std::size_t(tetmesh::cellTets(e.element.shape).count); ++t)
            if (e.element.fraction[t] > 0) {
                EXPECT_LT((after[t] - before[t]).norm(), kRounding * (kBallGel.mu + before[t].norm())) << i;
            }
    }
}

TEST_P(FlowCases, DensitiesAddUpToTheEnergy)
{
    constexpr double kRounding = 1e-12;
    const auto x = body.shaken(0.2);
    std::vector<double> density;
    elastic.energyDensities(x, density);
    double energy = 0, volume = body.block.h * body.block.h * body.block.h;
    for (std::size_t e = 0; e < body.block.elements.size(); ++e) {
        const tetmesh::CellElement& element = body.block.elements[e];
        for (std::size_t t = 0; t < std::size_t(tetmesh::cellTets(element.shape).count); ++t)
            energy += density[tetmesh::tetEntry(e, t)] * volume * element.fraction[t] *
                      tetmesh::cellTets(element.shape).volume[t];
    }
    const double expected = elastic.evaluate(x, {}, nullptr);
    EXPECT_NEAR(energy, expected, kRounding * expected);
}

TEST_P(FlowCases, GradientIsTheDerivativeOfTheEnergy)
{
    // Step^2, and rounding over it.
    EXPECT_LT(lab::errorOfGradient(elastic, body.shaken(0.2), body.random(1, 5), 1e-4 * body.block.h), 1e-7);
}

TEST_P(FlowCases, ProductIsTheDerivativeOfTheGradient)
{
    // The tangent is kept in single precision.
    EXPECT_LT(lab::errorOfProduct(elastic, body.shaken(0.1), body.random(1, 5), 1e-5 * body.block.h), 1e-6);
}

TEST_P(FlowCases, DiagonalBlocksAndElementMatricesAreThoseOfTheProduct) { lab::expectPartsOfTheProduct(elastic, body); }

/// The same flow everywhere and x = Fp X leave no elastic deformation.
TEST_P(FlowCases, ABodyThatFollowsItsFlowHasNoEnergy)
{
    constexpr double kRounding = 1e-13;
    std::mt19937 random(11);
    const Mat3 flow = randomFlow(random, .3), inverse = flow.inverse();
    Body uniform(std::get<2>(GetParam()));
    uniform.flow = tetmesh::TetField<Mat3>(uniform.block.elements.size(), inverse);
    const auto operatorOfFlow = uniform.elastic(elasticity());
    std::vector<Vec3> x, rest, g(uniform.block.nodes.size(), Vec3::Zero()), atRest = g;
    for (const Coord& c : uniform.block.nodes)
        rest.push_back(uniform.block.h * c.toVec()), x.push_back(flow * rest.back());
    const double energy = operatorOfFlow.evaluate(x, g, nullptr),
                 scale = operatorOfFlow.evaluate(rest, atRest, nullptr);
    EXPECT_LT(energy, kRounding * scale);
    EXPECT_LT(solver::dot(g, g), kRounding * kRounding * solver::dot(atRest, atRest) * double(g.size()));
}

/// What has no flow in its batch is computed as if there were none anywhere.
TEST_P(FlowCases, WhereNothingHasFlowedTheBitsAreThoseWithoutFlow)
{
    solver::ElementSet plain = body.set(), identity = plain, one = plain;
    plain.inverseFlow = nullptr, plain.stiffness = {};
    const std::vector<float> ones(body.stiffness.size(), 1.F);
    tetmesh::TetField<Mat3> field(body.block.elements.size(), Mat3::Identity());
    identity.inverseFlow = &field, identity.stiffness = ones;
    tetmesh::TetField<Mat3> single = field;
    std::mt19937 random(5);
    const std::size_t flowed = body.block.elements.size() / 2;
    single(flowed, 0) = randomFlow(random, .2);
    one.inverseFlow = &single, one.stiffness = {};

    const auto x = body.shaken(0.2);
    const auto of = [&](const solver::ElementSet& set) {
        std::vector<Vec3> g(x.size(), Vec3::Zero());
        body.elastic(set, elasticity()).evaluate(x, g, nullptr);
        return g;
    };
    const auto without = of(plain), unchanged = of(identity), mixed = of(one);
    EXPECT_EQ(without, unchanged);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < x.size(); ++i) differ += mixed[i] != without[i];
    EXPECT_GE(differ, 4U);
    EXPECT_LE(differ, 8U * 8U);  // nodes of the eight cells of a batch
}

INSTANTIATE_TEST_SUITE_P(Laws, FlowCases,
                         testing::Combine(testing::Values(Strain::corotational, Strain::linear, Strain::green),
                                          testing::Values(std::pair{Volumetric::none, 0.},
                                                          std::pair{Volumetric::cell, 0.},
                                                          std::pair{Volumetric::cell, .75}),
                                          testing::Values(Shape::six, Shape::five, Shape::tets)));

/// The bound of each tet alone holds for the elements, and a single tet reaches it.
TEST(Flow, HighestFrequencyIsThatOfTheTetsAsTheyHaveFlowed)
{
    constexpr double kStored = 1e-6;  // single precision
    Body body(Shape::tets);
    body.block.elements.resize(1), body.gradients.resize(1);
    const tetmesh::CellElement& tet = body.block.elements[0];
    const auto elastic = body.elastic(Volumetric::none);
    std::vector<Vec3> x;
    for (const Coord& c : body.block.nodes) x.push_back(body.flow(0, 0).inverse() * (body.block.h * c.toVec()));
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    elastic.warp(tangent);
    const Eigen::Matrix<double, 12, 12> K = elastic.elementMatrix(tangent, 0).topLeftCorner<12, 12>();
    const double highest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>>(K).eigenvalues()[11] / elastic.mass()[tet.node[0]];
    EXPECT_NE(body.flow(0, 0), Mat3::Identity());
    EXPECT_NEAR(elastic.highestFrequency(), std::sqrt(highest), kStored * std::sqrt(highest));
}

}  // namespace
