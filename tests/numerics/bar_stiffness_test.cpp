// Bending and torsion of a square bar, by the difference of two lengths: what its ends do drops out.
#include <vdbfrac/lab/samples/cantilever.h>
#include <vdbfrac/lab/samples/loads.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

using namespace vdbfrac;
using Kind = tetmesh::Lattice::Kind;

namespace {

constexpr double kE = 1, kNu = .3;
const solver::Material kMaterial = solver::makeMaterial(kE, kNu, 1);
constexpr double kAngle = 1e-3;  // rad; strains are linear
// Of a square bar of side 1: E a^4 / 12, and G times the torsion constant of Saint-Venant.
constexpr double kBending = kE / 12, kTorsion = .140577 * kE / (2 * (1 + kNu));

/// Angle over moment of a bar along z, of section 1 x 1, whose ends are planes that turn by kAngle about `axis` against
/// each other.
double compliance(Kind kind, int thick, int length, double meanStrain, int axis)
{
    const double h = 1. / thick;
    const lab::Block bar({thick, thick, thick * length}, h, kind);
    const auto elastic =
        lab::elasticOperator(bar, kMaterial, {solver::Volumetric::cell, solver::Strain::linear, meanStrain});
    const int top = thick * length;
    solver::Boundary boundary = lab::clamped(bar, [top](Coord c) { return c.z == 0 || c.z == top; });
    solver::State state = lab::atRest(bar);
    for (std::size_t i = 0; i < bar.nodes.size(); ++i) {
        const Vec3 X = h * bar.nodes[i].toVec() - Vec3(.5, .5, .5 * length);
        const Vec3 turn = kAngle * X.z() / length * Vec3::Unit(axis);
        // In pure bending the middle moves sideways by z^2 / 2 of the curvature.
        const Vec3 aside = axis == 0 ? Vec3(0, -kAngle * X.z() * X.z() / (2 * length), 0) : Vec3(0, 0, 0);
        state.x[i] += turn.cross(Vec3(X.x(), X.y(), 0)) + aside;
    }
    boundary.target = state.x;
    const auto report = solver::stepBackwardEuler(elastic, state, lab::kStatic, {{}, boundary}, lab::tightSettings());
    EXPECT_EQ(report.status, solver::StepStatus::converged);
    return kAngle * kAngle / (2 * report.elasticEnergy);
}

/// Relative error of the stiffness of a bar `thick` cells thick.
double errorOf(Kind kind, int thick, double meanStrain, int axis)
{
    constexpr int kShort = 2, kLong = 4;
    const double stiffness = (kLong - kShort) / (compliance(kind, thick, kLong, meanStrain, axis) -
                                                 compliance(kind, thick, kShort, meanStrain, axis));
    return stiffness / (axis == 0 ? kBending : kTorsion) - 1;
}

struct Bound {
    Kind kind;
    int thick;
    double bending, torsion;  ///< largest error
};

class BarStiffness : public testing::TestWithParam<Bound> {};

TEST_P(BarStiffness, IsThatOfTheBeamWithMeanStrain)
{
    constexpr double kShare = .75;
    const Bound& b = GetParam();
    const double bending = errorOf(b.kind, b.thick, kShare, 0), torsion = errorOf(b.kind, b.thick, kShare, 2);
    std::printf("%d cells: EI %+.2f %%, GJ %+.2f %%; tets alone %+.2f %%, %+.2f %%\n", b.thick, 100 * bending,
                100 * torsion, 100 * errorOf(b.kind, b.thick, 0, 0), 100 * errorOf(b.kind, b.thick, 0, 2));
    EXPECT_LT(std::abs(bending), b.bending);
    EXPECT_LT(std::abs(torsion), b.torsion);
}

INSTANTIATE_TEST_SUITE_P(Cells, BarStiffness,
                         testing::Values(Bound{Kind::six, 4, .04, .08}, Bound{Kind::six, 8, .01, .02},
                                         Bound{Kind::five, 4, .04, .10}, Bound{Kind::five, 8, .01, .025}));

TEST(BarStiffnessOrder, ConvergesWithTheSquareOfTheSpacing)
{
    constexpr double kOrder = 1.8;
    for (int axis : {0, 2})
        EXPECT_GT(std::log2(errorOf(Kind::six, 4, .75, axis) / errorOf(Kind::six, 8, .75, axis)), kOrder) << axis;
}

}  // namespace
