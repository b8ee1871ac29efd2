// The vectorised kernel against the scalar reference and against finite differences.
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/solver/backward_euler.h>
#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <random>
#include <vector>

using namespace vdbfrac;
using lab::kGel;
using lab::randomVec;
using solver::Volumetric;
using tetmesh::Lattice;

namespace {

std::vector<Vec3> shaken(const tetmesh::CutMesh& mesh, double size, unsigned seed)
{
    std::mt19937 random(seed);
    std::vector<Vec3> x;
    for (std::size_t i = 0; i < mesh.nodeCount(); ++i) x.push_back(mesh.restPosition(i) + randomVec(random, size));
    return x;
}

Mat3 deformationGradient(const tetmesh::CutMesh& mesh, const tetmesh::CellElement& e, int t, const std::vector<Vec3>& x)
{
    const auto& tets = tetmesh::cellTets(e.shape);
    Mat3 F = Mat3::Zero();
    for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t d = 0; d < 3; ++d)
            F.col(Eigen::Index(d)) += tets.gradient[std::size_t(t)][a][d] / mesh.lattice().spacing() *
                                      x[e.node[std::size_t(tets.corner[std::size_t(t)][a])]];
    return F;
}

double referenceEnergy(const tetmesh::CutMesh& mesh, const std::vector<Vec3>& x, Volumetric volumetric)
{
    double energy = 0;
    for (const auto& e : mesh.elements()) {
        const auto& tets = tetmesh::cellTets(e.shape);
        double volume = 0, bulk = 0;
        for (int t = 0; t < tets.count; ++t) {
            const double V =
                std::pow(mesh.lattice().spacing(), 3) * tets.volume[std::size_t(t)] * e.fraction[std::size_t(t)];
            if (V == 0) continue;
            const Vec3 strain = solver::signedPolar(deformationGradient(mesh, e, t, x)).s - Vec3::Ones();
            energy += V * kGel.mu * strain.squaredNorm();
            // Averaged is the whole bulk part, K = lambda + 2 mu/3; the tets keep the deviatoric part.
            energy += 0.5 * V * (volumetric == Volumetric::none ? kGel.lambda : -2. / 3. * kGel.mu) *
                      std::pow(strain.sum(), 2);
            bulk += V * strain.sum();
            volume += V;
        }
        if (volumetric == Volumetric::cell) energy += 0.5 * (kGel.lambda + 2. / 3. * kGel.mu) * bulk * bulk / volume;
    }
    return energy;
}

std::vector<Vec3> referenceGradient(const tetmesh::CutMesh& mesh, const std::vector<Vec3>& x, Volumetric volumetric)
{
    const double h = mesh.lattice().spacing(), bulk = kGel.lambda + 2. / 3. * kGel.mu;
    std::vector<Vec3> gradient(x.size(), Vec3::Zero());
    for (const auto& e : mesh.elements()) {
        const auto& tets = tetmesh::cellTets(e.shape);
        const auto volumeOf = [&](int t) {
            return std::pow(h, 3) * tets.volume[std::size_t(t)] * e.fraction[std::size_t(t)];
        };
        double volume = 0, dilation = 0;
        for (int t = 0; t < tets.count; ++t)
            if (volumeOf(t) > 0) {
                dilation +=
                    volumeOf(t) * (solver::signedPolar(deformationGradient(mesh, e, t, x)).s - Vec3::Ones()).sum();
                volume += volumeOf(t);
            }
        for (int t = 0; t < tets.count; ++t) {
            if (volumeOf(t) == 0) continue;
            const Mat3 F = deformationGradient(mesh, e, t, x);
            const solver::Polar polar = solver::signedPolar(F);
            const double trace = (polar.s - Vec3::Ones()).sum();
            const double pressure = volumetric == Volumetric::none
                                        ? kGel.lambda * trace
                                        : bulk * dilation / volume - 2. / 3. * kGel.mu * trace;
            const Mat3 P = 2 * kGel.mu * (F - polar.R) + pressure * polar.R;
            for (std::size_t a = 0; a < 4; ++a) {
                const auto& g = tets.gradient[std::size_t(t)][a];
                gradient[e.node[std::size_t(tets.corner[std::size_t(t)][a])]] +=
                    volumeOf(t) / h * P * Vec3(g[0], g[1], g[2]);
            }
        }
    }
    return gradient;
}

double largest(const std::vector<Vec3>& vectors)
{
    double most = 0;
    for (const Vec3& v : vectors) most = std::max(most, v.norm());
    return most;
}

/// A ball cut by the lattice: whole and cut cells, rows and loose lanes.
tetmesh::CutMesh ball(Lattice lattice)
{
    const double r = 4.3 * lattice.voxelSize;
    return {lattice, lab::sample({-5, -5, -5}, {5, 5, 5}, lattice.voxelSize, [r](Vec3 p) { return p.norm() - r; })};
}

struct Case {
    Lattice lattice;
    Volumetric volumetric;

    friend void PrintTo(const Case& c, std::ostream* out)
    {
        *out << (c.lattice.kind == Lattice::Kind::six ? "six" : "five") << " tets, coarsening " << c.lattice.coarsening
             << (c.volumetric == Volumetric::cell ? ", averaged" : "");
    }
};

class KernelCases : public testing::TestWithParam<Case> {};

TEST_P(KernelCases, EnergyEqualsScalarReference)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    for (double size : {0.0, 0.02, 0.3, 2.0}) {  // rest, small, large, inverted
        const auto x = shaken(mesh, size * mesh.lattice().spacing(), 7);
        const double expected = referenceEnergy(mesh, x, GetParam().volumetric);
        EXPECT_NEAR(elastic.evaluate(x, {}, nullptr), expected, 1e-12 * expected + 1e-20) << size;
    }
}

TEST_P(KernelCases, GradientEqualsScalarReference)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    for (double size : {0.02, 0.3, 2.0}) {  // small, large, inverted
        const auto x = shaken(mesh, size * mesh.lattice().spacing(), 7);
        const auto expected = referenceGradient(mesh, x, GetParam().volumetric);
        std::vector<Vec3> gradient(mesh.nodeCount(), Vec3::Zero());
        (void)elastic.evaluate(x, gradient, nullptr);
        for (std::size_t i = 0; i < x.size(); ++i) gradient[i] -= expected[i];
        EXPECT_LT(largest(gradient), 1e-11 * largest(expected)) << size;
    }
}

/// What the vectorised forces come to solves the step of the scalar ones too.
TEST_P(KernelCases, StepsEndInBalanceWithScalarForces)
{
    constexpr double dt = 0.004;
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    solver::BackwardEuler stepper(elastic, lab::tightSettings());
    solver::State state{shaken(mesh, 0.05 * mesh.lattice().spacing(), 7),
                        std::vector<Vec3>(mesh.nodeCount(), Vec3(0, 1, 0))};
    for (int step = 0; step < 5; ++step) {
        const solver::State before = state;
        ASSERT_EQ(stepper.step(state, dt, {{}, lab::freeBoundary(mesh.nodeCount())}).status,
                  solver::StepStatus::converged);
        const auto force = referenceGradient(mesh, state.x, GetParam().volumetric);
        std::vector<Vec3> left = force;
        for (std::size_t i = 0; i < left.size(); ++i)
            left[i] += elastic.mass()[i] / (dt * dt) * (state.x[i] - before.x[i] - dt * before.v[i]);
        EXPECT_LT(largest(left), 1e-9 * largest(force)) << step;
    }
}

TEST_P(KernelCases, GradientIsDerivativeOfEnergy)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.2 * mesh.lattice().spacing(), 3);
    std::vector<Vec3> gradient(mesh.nodeCount(), Vec3::Zero());
    const double energy = elastic.evaluate(x, gradient, nullptr);
    std::mt19937 random(5);
    const double step = 1e-4 * mesh.lattice().spacing();
    auto plus = x, minus = x;
    double expected = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Vec3 d = randomVec(random, step);
        plus[i] += d, minus[i] -= d;
        expected += gradient[i].dot(d);
    }
    // Central difference: the error is of third order in the step.
    EXPECT_NEAR(0.5 * (elastic.evaluate(plus, {}, nullptr) - elastic.evaluate(minus, {}, nullptr)), expected,
                1e-8 * energy);
}

TEST_P(KernelCases, ProductIsDerivativeOfGradientAndSymmetric)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.15 * mesh.lattice().spacing(), 3);
    const std::size_t n = mesh.nodeCount();
    std::vector<Vec3> gradient(n, Vec3::Zero()), up(n, Vec3::Zero()), down(n, Vec3::Zero()), Ku(n, Vec3::Zero()),
        Kw(n, Vec3::Zero());
    solver::Tangent tangent;
    elastic.evaluate(x, gradient, &tangent);
    std::mt19937 random(5);
    std::vector<Vec3> u(n), w(n), plus = x, minus = x;
    const double step = 1e-5 * mesh.lattice().spacing();
    for (std::size_t i = 0; i < n; ++i) {
        u[i] = randomVec(random, 1), w[i] = randomVec(random, 1);
        plus[i] += step * u[i], minus[i] -= step * u[i];
    }
    elastic.addProduct(tangent, u, Ku);
    elastic.addProduct(tangent, w, Kw);
    elastic.evaluate(plus, up, nullptr);
    elastic.evaluate(minus, down, nullptr);
    double error = 0, size = 0, uKw = 0, wKu = 0;
    for (std::size_t i = 0; i < n; ++i) {
        error += (Ku[i] - (up[i] - down[i]) / (2 * step)).squaredNorm();
        size += Ku[i].squaredNorm();
        uKw += u[i].dot(Kw[i]), wKu += w[i].dot(Ku[i]);
    }
    EXPECT_LT(std::sqrt(error / size), 1e-7);  // central difference with a step of 1e-5
    EXPECT_NEAR(uKw, wKu, 1e-12 * std::abs(uKw) + 1e-12 * std::sqrt(size));
}

TEST_P(KernelCases, DiagonalBlocksAreThoseOfTheProduct)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.15 * mesh.lattice().spacing(), 3);
    const std::size_t n = mesh.nodeCount();
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    constexpr double kStored = 1e-6;  // R is kept in single precision, and the blocks take it for a rotation
    const std::vector<Mat3> blocks = lab::diagonalBlocks(elastic, tangent);
    for (std::size_t i = 0; i < n; i += 37)
        for (int d = 0; d < 3; ++d) {
            std::vector<Vec3> u(n, Vec3::Zero()), Ku(n, Vec3::Zero());
            u[i] = Vec3::Unit(d);
            elastic.addProduct(tangent, u, Ku);
            EXPECT_LT((Ku[i] - blocks[i].col(d)).norm(), kStored * blocks[i].norm());
        }
}

TEST_P(KernelCases, ProjectedTangentIsSemidefinite)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = lab::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.8 * mesh.lattice().spacing(), 11);
    const std::size_t n = mesh.nodeCount();
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    elastic.project(tangent);
    std::mt19937 random(1);
    for (int trial = 0; trial < 50; ++trial) {
        std::vector<Vec3> u(n), Ku(n, Vec3::Zero());
        for (Vec3& v : u) v = randomVec(random, 1);
        elastic.addProduct(tangent, u, Ku);
        double uKu = 0;
        for (std::size_t i = 0; i < n; ++i) uKu += u[i].dot(Ku[i]);
        EXPECT_GE(uKu, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Lattices, KernelCases,
                         testing::Values(Case{{Lattice::Kind::six, 1, 0.1}, Volumetric::none},
                                         Case{{Lattice::Kind::six, 1, 0.1}, Volumetric::cell},
                                         Case{{Lattice::Kind::six, 2, 0.1}, Volumetric::cell},
                                         Case{{Lattice::Kind::five, 1, 0.1}, Volumetric::none},
                                         Case{{Lattice::Kind::five, 1, 0.1}, Volumetric::cell}));

/// The tets of a lattice as tets of any shape, in patches of `perPatch`.
struct LooseTets {
    std::vector<tetmesh::CellElement> elements;
    std::vector<tetmesh::TetGradients> gradients;

    LooseTets(const tetmesh::CutMesh& mesh, std::uint32_t perPatch)
    {
        for (const tetmesh::CellElement& cell : mesh.elements()) {
            const tetmesh::CellTets& tets = tetmesh::cellTets(cell.shape);
            for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
                if (cell.fraction[t] == 0) continue;
                tetmesh::CellElement tet;
                tet.node.fill(cell.node[std::size_t(tets.corner[t][0])]);
                for (std::size_t a = 0; a < 4; ++a) tet.node[a] = cell.node[std::size_t(tets.corner[t][a])];
                tet.fraction[0] = tets.volume[t] * cell.fraction[t];
                tet.shape = tetmesh::CellShape::tet;
                tet.patch = std::uint32_t(elements.size()) / perPatch;
                gradients.push_back({tets.gradient[t][1], tets.gradient[t][2], tets.gradient[t][3]});
                elements.push_back(tet);
            }
        }
    }
};

/// Crumbs have nodes of their own, and a block of cells may hold more of them than 16 bits can number.
TEST(Kernel, BlocksOfVeryManyNodesAgreeWithSmallOnes)
{
    constexpr std::uint32_t kCrumbs = 9000;
    const lab::Block one({1, 1, 1}, 0.1);
    const std::vector<Vec3> bent = one.bentPositions();
    std::vector<Coord> nodes;
    std::vector<Vec3> x;
    std::vector<tetmesh::CellElement> elements;
    for (std::uint32_t i = 0; i < kCrumbs; ++i) {
        elements.push_back(one.elements[0]);
        for (std::uint32_t& n : elements.back().node) n += std::uint32_t(nodes.size());
        nodes.insert(nodes.end(), one.nodes.begin(), one.nodes.end());
        x.insert(x.end(), bent.begin(), bent.end());
    }
    const solver::ElementSet crumbs{elements, nodes, 0, kGel}, alone{one.elements, one.nodes, 0, kGel};
    std::vector<Vec3> force(x.size(), Vec3::Zero()), expected(bent.size(), Vec3::Zero());
    (void)solver::ElasticOperator(std::span(&crumbs, 1), std::uint32_t(nodes.size()), 0.1, Volumetric::cell)
        .evaluate(x, force, nullptr);
    (void)solver::ElasticOperator(std::span(&alone, 1), 8, 0.1, Volumetric::cell).evaluate(bent, expected, nullptr);
    EXPECT_GT(expected[0].norm(), 0);
    for (std::size_t i = 0; i < force.size(); ++i) ASSERT_EQ(force[i], expected[i % 8]) << i;
}

/// The rest shape of a tet that is kept beside it gives what the lattice knows at compile time.
TEST(Kernel, TetsOfAnyShapeAgreeWithThoseOfALattice)
{
    const tetmesh::CutMesh mesh = ball({Lattice::Kind::six, 1, 0.1});
    const LooseTets loose(mesh, 100);
    const solver::ElementSet cells{mesh.elements(), mesh.nodes(), 0, kGel},
        tets{loose.elements, {}, 0, kGel, loose.gradients};
    const solver::ElasticOperator lattice(std::span(&cells, 1), mesh.nodeCount(), 0.1, Volumetric::none);
    const std::vector<Vec3> x = shaken(mesh, 0.02, 5), u = shaken(mesh, 1, 6);
    const std::size_t n = x.size();
    constexpr double kRounding = 1e-12, kSingle = 1e-6;                   // tangents are kept in single precision
    for (Volumetric volumetric : {Volumetric::none, Volumetric::cell}) {  // the mean over one tet is its own
        const solver::ElasticOperator free(std::span(&tets, 1), mesh.nodeCount(), 0.1, volumetric);
        std::vector<Vec3> g1(n, Vec3::Zero()), g2 = g1, Ku1 = g1, Ku2 = g1;
        solver::Tangent t1, t2;
        const double energy = lattice.evaluate(x, g1, &t1);
        EXPECT_NEAR(free.evaluate(x, g2, &t2), energy, kRounding * energy);
        lattice.addProduct(t1, u, Ku1);
        free.addProduct(t2, u, Ku2);
        EXPECT_LE(lab::norm(lab::difference(g1, g2)), kRounding * lab::norm(g1));
        EXPECT_LE(lab::norm(lab::difference(Ku1, Ku2)), kSingle * lab::norm(Ku1));
        const auto d1 = lab::diagonalBlocks(lattice, t1), d2 = lab::diagonalBlocks(free, t2);
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_LE((d1[i] - d2[i]).norm(), kSingle * d1[i].norm());
            EXPECT_NEAR(free.mass()[i], lattice.mass()[i], kRounding * lattice.mass()[i]);
        }
        EXPECT_EQ(free.tetCount(), lattice.tetCount());
    }
}

/// The matrix of an element is that of its product.
TEST(Kernel, MatrixOfALooseTetIsThatOfItsProduct)
{
    const tetmesh::CutMesh mesh = ball({Lattice::Kind::six, 1, 0.1});
    LooseTets loose(mesh, 1);
    loose.elements.resize(1), loose.gradients.resize(1);
    const solver::ElementSet tets{loose.elements, {}, 0, kGel, loose.gradients};
    const solver::ElasticOperator free(std::span(&tets, 1), mesh.nodeCount(), 0.1, Volumetric::none);
    solver::Tangent tangent;
    free.evaluate(shaken(mesh, 0.02, 5), {}, &tangent);
    const std::vector<Vec3> u = shaken(mesh, 1, 6);
    std::vector<Vec3> Ku(u.size(), Vec3::Zero());
    free.addProduct(tangent, u, Ku);
    Eigen::Matrix<double, 24, 1> own = Eigen::Matrix<double, 24, 1>::Zero();
    for (std::size_t a = 0; a < 4; ++a) own.segment<3>(Eigen::Index(3 * a)) = u[loose.elements[0].node[a]];
    own = free.elementMatrix(tangent, 0) * own;
    for (std::size_t a = 0; a < 4; ++a)
        EXPECT_LE((own.segment<3>(Eigen::Index(3 * a)) - Ku[loose.elements[0].node[a]]).norm(), 1e-10 * own.norm());
}

}  // namespace
