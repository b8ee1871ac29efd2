// Forces of the corners of an element against differences of its energy, in space and in the rest configuration.
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/solver/corotational.h>
#include <vdbfrac/solver/element.h>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <random>
#include <string>

using namespace vdbfrac;
using solver::Elasticity;
using solver::Strain;
using solver::Volumetric;
using tetmesh::CellShape;

namespace {

constexpr double h = .3;
constexpr solver::Material kGel = solver::makeMaterial(1e5, .35, 1000);

struct Case {
    const char* name;
    CellShape shape;
    Elasticity elasticity;
};

/// An element of which some tets are cut, with all of its corners anywhere near where they belong.
struct Shaken {
    tetmesh::CellElement element;
    std::vector<Vec3> X, x;  // m

    explicit Shaken(CellShape shape)
    {
        std::mt19937 random(7);
        element.shape = shape;
        for (std::uint32_t c = 0; c < tetmesh::kCorners; ++c) {
            element.node[c] = c;
            X.push_back(h * Vec3(c & 1, c >> 1 & 1, c >> 2));
            x.push_back(X.back() + lab::randomVec(random, .2 * h));
        }
        for (int t = 0; t < tetmesh::cellTets(shape).count; ++t) element.fraction[std::size_t(t)] = 1 - .15 * t;
    }
};

Mat3 strainOf(const Mat3& F, Strain strain)
{
    if (strain == Strain::green) return .5 * (F.transpose() * F - Mat3::Identity());
    if (strain == Strain::linear) return .5 * (F + F.transpose()) - Mat3::Identity();
    return solver::signedPolar(F).S - Mat3::Identity();
}

/// J, from the places of the corners alone.
double energyOf(const Shaken& s, const std::vector<Vec3>& X, const std::vector<Vec3>& x, Elasticity elasticity)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(s.element.shape);
    const bool isCell = elasticity.volumetric == Volumetric::cell;
    const double K = kGel.lambda + 2. / 3. * kGel.mu, own = isCell ? -2. / 3. * kGel.mu : kGel.lambda;
    const auto density = [&](const Mat3& F) {
        const Mat3 e = strainOf(F, elasticity.strain);
        return kGel.mu * e.squaredNorm() + .5 * own * e.trace() * e.trace();
    };
    double energy = 0, volume = 0, dilation = 0;
    Mat3 mean = Mat3::Zero();
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        Mat3 D, d;
        for (int a = 1; a < 4; ++a) {
            const auto corner = [&](int b) { return std::size_t(tets.corner[t][std::size_t(b)]); };
            D.col(a - 1) = X[corner(a)] - X[corner(0)], d.col(a - 1) = x[corner(a)] - x[corner(0)];
        }
        const Mat3 F = d * D.inverse();
        const double V = s.element.fraction[t] * D.determinant() / 6;
        energy += (1 - elasticity.meanStrain) * V * density(F);
        volume += V, mean += V * F, dilation += V * strainOf(F, elasticity.strain).trace();
    }
    energy += elasticity.meanStrain * volume * density(mean / volume);
    return isCell ? energy + .5 * K * dilation * dilation / volume : energy;
}

class ElementForces : public testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(
    Elements, ElementForces,
    testing::Values(Case{"six", CellShape::six, {Volumetric::cell, Strain::corotational, 0}},
                    Case{"six_mean", CellShape::six, {Volumetric::cell, Strain::corotational, .75}},
                    Case{"five_mean", CellShape::fiveOdd, {Volumetric::cell, Strain::corotational, .75}},
                    Case{"six_tet", CellShape::six, {Volumetric::none, Strain::corotational}},
                    Case{"six_linear", CellShape::six, {Volumetric::cell, Strain::linear, .75}},
                    Case{"six_green", CellShape::six, {Volumetric::cell, Strain::green, .75}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST_P(ElementForces, AreThoseOfTheEnergy)
{
    constexpr double kStep = 1e-6 * h, kDifferences = 1e-7;
    const Shaken s(GetParam().shape);
    const Elasticity elasticity = GetParam().elasticity;
    const auto forces = solver::elementForces({s.element, nullptr, h}, s.x, kGel, elasticity);
    double size = 0, volume = 0;
    for (const auto& corner : forces) size = std::max(size, corner.elastic.norm()), volume += corner.volume;
    const auto slope = [&](std::vector<Vec3> X, std::vector<Vec3> x, bool atRest, std::size_t corner, int axis) {
        double& at = (atRest ? X : x)[corner][axis];
        const double middle = at;
        at = middle + kStep;
        const double after = energyOf(s, X, x, elasticity);
        at = middle - kStep;
        return (after - energyOf(s, X, x, elasticity)) / (2 * kStep);
    };
    for (std::size_t c = 0; c < forces.size(); ++c)
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(forces[c].elastic[axis], slope(s.X, s.x, false, c, axis), kDifferences * size) << c;
            EXPECT_NEAR(forces[c].material[axis], slope(s.X, s.x, true, c, axis), kDifferences * size) << c;
        }
    double whole = 0;
    const tetmesh::CellTets& tets = tetmesh::cellTets(s.element.shape);
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t)
        whole += h * h * h * tets.volume[t] * s.element.fraction[t];
    EXPECT_NEAR(volume, whole, 1e-12 * whole);
}

/// As a rigid body turns and moves, its material forces stay.
TEST_P(ElementForces, OfMaterialDoNotSeeARigidMotion)
{
    if (GetParam().elasticity.strain == Strain::linear) return;  // it takes a turn for a strain
    const Shaken s(GetParam().shape);
    const Mat3 R = solver::signedPolar(Mat3{{.6, -.7, .1}, {.8, .5, .3}, {-.2, .1, .9}}).R;
    std::vector<Vec3> turned;
    for (const Vec3& x : s.x) turned.push_back(R * x + Vec3(3, -1, 2));
    const auto before = solver::elementForces({s.element, nullptr, h}, s.x, kGel, GetParam().elasticity);
    const auto after = solver::elementForces({s.element, nullptr, h}, turned, kGel, GetParam().elasticity);
    for (std::size_t c = 0; c < before.size(); ++c) {
        const double size = 1e-9 * (before[c].material.norm() + before[c].elastic.norm());
        EXPECT_LT((after[c].material - before[c].material).norm(), size) << c;
        EXPECT_LT((after[c].elastic - R * before[c].elastic).norm(), size) << c;
    }
}

}  // namespace
