// The vectorised kernel against the scalar reference and against finite differences.
#include "../../solver/src/kernel.h"
#include "block.h"
#include "solids.h"

#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <type_traits>

using namespace vdbfrac;
using solver::Volumetric;
using tetmesh::Lattice;

namespace {

using test::kGel;

Vec3 randomVec(std::mt19937& random, double size)
{
    std::uniform_real_distribution<double> uniform(-size, size);
    return {uniform(random), uniform(random), uniform(random)};
}

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
            const double V = std::pow(mesh.lattice().spacing(), 3) * tets.volume[std::size_t(t)] * e.fraction[std::size_t(t)];
            if (V == 0) continue;
            const Vec3 strain = solver::signedPolar(deformationGradient(mesh, e, t, x)).s - Vec3::Ones();
            energy += V * kGel.mu * strain.squaredNorm();
            // Averaged is the whole bulk part, K = lambda + 2 mu/3; the tets keep the deviatoric part.
            energy += 0.5 * V * (volumetric == Volumetric::none ? kGel.lambda : -2. / 3. * kGel.mu) * std::pow(strain.sum(), 2);
            bulk += V * strain.sum();
            volume += V;
        }
        if (volumetric == Volumetric::cell) energy += 0.5 * (kGel.lambda + 2. / 3. * kGel.mu) * bulk * bulk / volume;
    }
    return energy;
}

/// A ball cut by the lattice: whole and cut cells, rows and loose lanes.
tetmesh::CutMesh ball(Lattice lattice)
{
    const double r = 4.3 * lattice.voxelSize;
    return {lattice, test::sample({-5, -5, -5}, {5, 5, 5}, lattice.voxelSize, [r](Vec3 p) { return p.norm() - r; })};
}

struct Case {
    Lattice lattice;
    Volumetric volumetric;
};

class KernelCases : public testing::TestWithParam<Case> {};

TEST_P(KernelCases, EnergyEqualsScalarReference)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = test::elasticOperator(mesh, kGel, GetParam().volumetric);
    for (double size : {0.0, 0.02, 0.3, 2.0}) {  // rest, small, large, inverted
        const auto x = shaken(mesh, size * mesh.lattice().spacing(), 7);
        const double expected = referenceEnergy(mesh, x, GetParam().volumetric);
        EXPECT_NEAR(elastic.evaluate(x, {}, nullptr), expected, 1e-12 * expected + 1e-20) << size;
    }
}

TEST_P(KernelCases, GradientIsDerivativeOfEnergy)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = test::elasticOperator(mesh, kGel, GetParam().volumetric);
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
    EXPECT_NEAR(0.5 * (elastic.evaluate(plus, {}, nullptr) - elastic.evaluate(minus, {}, nullptr)), expected, 1e-8 * energy);
}

TEST_P(KernelCases, ProductIsDerivativeOfGradientAndSymmetric)
{
    const auto mesh = ball(GetParam().lattice);
    const auto elastic = test::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.15 * mesh.lattice().spacing(), 3);
    const std::size_t n = mesh.nodeCount();
    std::vector<Vec3> gradient(n, Vec3::Zero()), up(n, Vec3::Zero()), down(n, Vec3::Zero()), Ku(n, Vec3::Zero()), Kw(n, Vec3::Zero());
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
    const auto elastic = test::elasticOperator(mesh, kGel, GetParam().volumetric);
    const auto x = shaken(mesh, 0.15 * mesh.lattice().spacing(), 3);
    const std::size_t n = mesh.nodeCount();
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    constexpr double kStored = 1e-6;  // R is kept in single precision, and the blocks take it for a rotation
    const std::vector<Mat3> blocks = test::diagonalBlocks(elastic, tangent);
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
    const auto elastic = test::elasticOperator(mesh, kGel, GetParam().volumetric);
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

/// The rest shape of a tet that is kept beside it gives what the lattice knows at compile time.
TEST(Kernel, TetsOfAnyShapeAgreeWithThoseOfALattice)
{
    const tetmesh::CutMesh mesh = ball({Lattice::Kind::six, 1, 0.1});
    const LooseTets loose(mesh, 100);
    const solver::ElementSet cells{mesh.elements(), mesh.nodes(), 0, kGel}, tets{loose.elements, {}, 0, kGel, loose.gradients};
    const solver::ElasticOperator lattice(std::span(&cells, 1), mesh.nodeCount(), 0.1, Volumetric::none);
    const std::vector<Vec3> x = shaken(mesh, 0.02, 5), u = shaken(mesh, 1, 6);
    const std::size_t n = x.size();
    constexpr double kRounding = 1e-12, kSingle = 1e-6;  // tangents are kept in single precision
    for (Volumetric volumetric : {Volumetric::none, Volumetric::cell}) {  // the mean over one tet is its own
        const solver::ElasticOperator free(std::span(&tets, 1), mesh.nodeCount(), 0.1, volumetric);
        std::vector<Vec3> g1(n, Vec3::Zero()), g2 = g1, Ku1 = g1, Ku2 = g1;
        solver::Tangent t1, t2;
        const double energy = lattice.evaluate(x, g1, &t1);
        EXPECT_NEAR(free.evaluate(x, g2, &t2), energy, kRounding * energy);
        lattice.addProduct(t1, u, Ku1);
        free.addProduct(t2, u, Ku2);
        EXPECT_LE(test::norm(test::difference(g1, g2)), kRounding * test::norm(g1));
        EXPECT_LE(test::norm(test::difference(Ku1, Ku2)), kSingle * test::norm(Ku1));
        const auto d1 = test::diagonalBlocks(lattice, t1), d2 = test::diagonalBlocks(free, t2);
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

/// A body of 45 nodes, the last five of a group of eight: some have one slot in a row, others none, one or two anywhere.
template <class Real>
struct RandomNodes {
    static constexpr std::size_t kNodes = 45, kSlots = 120;
    std::vector<Real> slot, r, p, step;
    std::vector<float> added;
    std::vector<double> mass, u;
    std::vector<solver::LaneBlocks> B{6};
    std::vector<std::uint32_t> straight{solver::kNoSlot, 16, solver::kNoSlot, 64, solver::kNoSlot, solver::kNoSlot}, start{0}, slots;

    RandomNodes()
    {
        std::mt19937 random(17);
        std::uniform_real_distribution<double> unit(-1, 1);
        const auto fill = [&](auto& v, std::size_t count) {
            v.resize(count);
            for (auto& value : v) value = std::remove_reference_t<decltype(value)>(unit(random));
        };
        fill(slot, 3 * kSlots), fill(r, 3 * kNodes), fill(p, 3 * kNodes), fill(step, 3 * kNodes);
        fill(added, kNodes), fill(mass, kNodes), fill(u, 3 * kNodes);
        for (solver::LaneBlocks& block : B)
            for (auto& row : block.v)
                for (float& v : row) v = float(unit(random));
        for (std::uint32_t n = 0; n < kNodes; ++n) {
            const std::uint32_t first = straight[n / 8];
            if (first != solver::kNoSlot)
                slots.push_back(first + n % 8);
            else
                for (std::uint32_t k = 0; k < n % 3; ++k) slots.push_back((7 * n + 31 * k) % std::uint32_t(kSlots));
            start.push_back(std::uint32_t(slots.size()));
        }
    }
    solver::SlotSums<Real> sums() const { return {slot.data(), straight.data(), start.data(), slots.data()}; }
    Vec3 sum(std::size_t n) const
    {
        Vec3 s = Vec3::Zero();
        for (std::uint32_t k = start[n]; k < start[n + 1]; ++k) s += point(slot, slots[k]);
        return s;
    }
    template <class T>
    static Vec3 point(const std::vector<T>& v, std::size_t n)
    {
        return Vec3(double(v[3 * n]), double(v[3 * n + 1]), double(v[3 * n + 2]));
    }
    Vec3 applyB(std::size_t n, const Vec3& v) const
    {
        const auto b = [&](std::size_t k) { return double(B[n / 8].v[k][n % 8]); };
        return (Mat3() << b(0), b(5), b(4), b(5), b(1), b(3), b(4), b(3), b(2)).finished() * v;
    }
};

/// A patch of two batches, one a row of whole cells and one of cut cells in any order, in a random state.
struct RandomPatch {
    static constexpr int kNodes = 40, kStride = kNodes + solver::kLanes;
    solver::Batch batch[2];
    solver::LaneCorners corners{};
    solver::LaneVolumes volumes{};
    std::vector<double> x;

    RandomPatch()
    {
        std::mt19937 random(2);
        for (std::size_t c = 0; c < tetmesh::kCorners; ++c) batch[0].corner[c] = std::uint16_t(9 * (c / 2) + c % 2);
        batch[1].gathered = batch[1].cut = 0;
        batch[1].tangent = tetmesh::kMostTets;
        for (auto& lane : corners.corner)
            for (auto& corner : lane) corner = std::uint16_t(random() % kNodes);
        for (auto& tet : volumes.share)
            for (double& share : tet) share = double(random() % 3) / 6;
        x.resize(3 * kStride);
        for (double& v : x) v = std::uniform_real_distribution<double>(-1, 1)(random);
    }

    /// Gradient, product, product in single precision, diagonal and energy, one after another.
    std::vector<double> run(const solver::Kernel& kernel, bool cellDilation) const
    {
        const solver::RobustTet scalar = {
            [](const double*, double* R, double* S) {
                for (int k = 0; k < 9; ++k) R[k] = k % 4 == 0;
                for (int k = 0; k < 6; ++k) S[k] = k < 3;
            },
            [](const double*, double t, double* T) {
                for (int k = 0; k < 6; ++k) T[k] = k < 3 ? t : 0;
            }};
        solver::TetTangent tangent[2 * tetmesh::kMostTets] = {};
        std::vector<double> out(x.size(), 0.), product(x.size(), 0.), diagonal(2 * x.size(), 0.);
        std::vector<float> in(x.begin(), x.end()), single(x.size(), 0.f);
        solver::PatchData d;
        d.batch = batch, d.corners = &corners, d.volumes = &volumes, d.tangent = tangent;
        d.batches = 2, d.nodes = kNodes, d.stride = kStride;
        d.h = 0.1, d.mu = 3e4, d.lambda = 5e4, d.share = 0.2;
        const auto result = kernel.evaluate(d, cellDilation, scalar, x.data(), out.data());
        out.push_back(kernel.twice.product(d, cellDilation, x.data(), product.data()));
        out.push_back(kernel.single.product(d, cellDilation, in.data(), single.data()));
        kernel.diagonal(d, cellDilation, diagonal.data());
        out.insert(out.end(), product.begin(), product.end());
        out.insert(out.end(), single.begin(), single.end());
        out.insert(out.end(), diagonal.begin(), diagonal.end());
        out.push_back(result.energy);
        RandomNodes<double> n;
        const solver::GradientNodes<double> nodes{n.sums(), n.B.data(), n.mass.data(), 2., n.r.data(), n.p.data(), n.u.data()};
        out.push_back(kernel.twice.descend(nodes, 0, n.kNodes, .3));
        out.push_back(kernel.twice.turn(nodes, 0, n.kNodes, .4, .7));
        out.insert(out.end(), n.p.begin(), n.p.end());
        return out;
    }
};

/// Rows that were read from points, and points that were written from rows, in runs of all lengths round a pack.
template <class Real>
void checkReadAndWrite(const solver::Kernel& kernel)
{
    constexpr int kPoints = 100, kNodes = 45, kSlots = 48, kStride = 56;
    std::vector<Real> points(3 * kPoints);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = Real(i + 1);
    const solver::NodeRun runs[] = {{50, 0, 1}, {7, 1, 8}, {99, 9, 1}, {60, 10, 17}, {20, 27, 7}, {30, 34, 11}};
    solver::PatchData d;
    d.run = runs, d.runs = int(std::size(runs)), d.nodes = kNodes, d.stride = kStride;
    alignas(64) Real rows[3 * kStride], back[3 * kSlots];
    std::fill(std::begin(rows), std::end(rows), Real(-1));
    kernel.of<Real>().read(d, points.data(), rows);
    kernel.of<Real>().write(d, rows, back);
    for (const solver::NodeRun& run : runs)
        for (int i = 0; i < run.count; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const Real expected = points[3 * (run.node + std::size_t(i)) + std::size_t(axis)];
                EXPECT_EQ(rows[axis * kStride + run.local + i], expected) << kernel.name;
                EXPECT_EQ(back[3 * (run.local + i) + axis], expected) << kernel.name;
            }
    for (int axis = 0; axis < 3; ++axis)
        for (int i = kNodes; i < kStride; ++i) EXPECT_EQ(rows[axis * kStride + i], 0) << kernel.name;
}

TEST(Kernel, PointsBecomeRowsAndRowsPoints)
{
    int count = 0;
    const solver::Kernel* const* all = solver::kernels(count);
    for (int k = 0; k < count; ++k) {
        checkReadAndWrite<double>(*all[k]);
        checkReadAndWrite<float>(*all[k]);
    }
}

template <class Real>
void checkGradientPasses(const solver::Kernel& kernel)
{
    using Nodes = RandomNodes<Real>;
    const double tolerance = 50 * double(std::numeric_limits<Real>::epsilon());  // sums of some ten products of order one
    const Real step = Real(.3), beta = Real(.7);
    Nodes after;
    const Nodes before;
    const solver::GradientNodes<Real> nodes{after.sums(), after.B.data(), after.mass.data(), 2., after.r.data(), after.p.data(), after.u.data()};
    const double rz = kernel.of<Real>().descend(nodes, 0, Nodes::kNodes, step);
    const double pMp = kernel.of<Real>().turn(nodes, 0, Nodes::kNodes, .4, beta);
    double expectedRz = 0, expectedPMp = 0;
    for (std::size_t n = 0; n < Nodes::kNodes; ++n) {
        const Vec3 p = Nodes::point(before.p, n);
        const Vec3 r = Nodes::point(before.r, n) - double(step) * (2 * before.mass[n] * p + before.sum(n)), z = before.applyB(n, r);
        const Vec3 turned = z + double(beta) * p;
        expectedRz += r.dot(z);
        expectedPMp += before.mass[n] * turned.squaredNorm();
        EXPECT_LT((Nodes::point(after.r, n) - r).norm(), tolerance) << kernel.name;
        EXPECT_LT((Nodes::point(after.p, n) - turned).norm(), tolerance) << kernel.name;
        EXPECT_LT((Nodes::point(after.u, n) - Nodes::point(before.u, n) - .4 * p).norm(), tolerance) << kernel.name;
    }
    EXPECT_NEAR(rz, expectedRz, double(Nodes::kNodes) * tolerance) << kernel.name;
    EXPECT_NEAR(pMp, expectedPMp, double(Nodes::kNodes) * tolerance) << kernel.name;
}

TEST(Kernel, PassesOfConjugateGradientsMatchTheirDefinition)
{
    int count = 0;
    const solver::Kernel* const* all = solver::kernels(count);
    for (int k = 0; k < count; ++k) {
        checkGradientPasses<double>(*all[k]);
        checkGradientPasses<float>(*all[k]);
    }
}

TEST(Kernel, SmootherMatchesItsDefinition)
{
    using Nodes = RandomNodes<float>;
    int count = 0;
    const solver::Kernel* const* all = solver::kernels(count);
    const Nodes before;
    for (int k = 0; k < count; ++k) {
        Nodes after;  // r stands for b, p for x
        all[k]->smooth({after.sums(), after.B.data(), after.added.data(), after.r.data(), after.p.data(), after.step.data()}, 0, Nodes::kNodes, .2f, .6f);
        for (std::size_t n = 0; n < Nodes::kNodes; ++n) {
            const Vec3 x = Nodes::point(before.p, n), residual = Nodes::point(before.r, n) - double(before.added[n]) * x - before.sum(n);
            const Vec3 step = double(.2f) * Nodes::point(before.step, n) + double(.6f) * before.applyB(n, residual);
            EXPECT_LT((Nodes::point(after.step, n) - step).norm(), 5e-6) << all[k]->name;
            EXPECT_LT((Nodes::point(after.p, n) - x - step).norm(), 5e-6) << all[k]->name;
        }
    }
}

/// Units that fuse multiplication and addition agree to the bit; plain code rounds twice where they round once.
TEST(Kernel, VectorUnitsThatFuseGiveTheSameBits)
{
    int count = 0;
    const solver::Kernel* const* all = solver::kernels(count);
    const RandomPatch patch;
    for (bool cellDilation : {false, true}) {
        const std::vector<double> plain = patch.run(*all[0], cellDilation);
        double largest = 0;
        for (double v : plain) largest = std::max(largest, std::abs(v));
        for (int k = 1; k < count; ++k) {
            const std::vector<double> fused = patch.run(*all[k], cellDilation);
            for (std::size_t i = 0; i < plain.size(); ++i)
                EXPECT_NEAR(fused[i], plain[i], 1e-5 * largest) << all[k]->name;  // the product in single precision rounds at 6e-8
            if (k > 1) {
                EXPECT_EQ(fused, patch.run(*all[k - 1], cellDilation)) << all[k]->name << " and " << all[k - 1]->name;
            }
        }
    }
}

TEST(Corotational, RigidTurnGivesNoStress)
{
    const test::Block mesh({3, 3, 3}, 1);
    const auto elastic = test::elasticOperator(mesh, kGel, Volumetric::none);
    std::mt19937 random(3);
    for (int trial = 0; trial < 50; ++trial) {
        const Mat3 R = Eigen::Quaterniond(Eigen::Vector4d(randomVec(random, 1).homogeneous())).normalized().toRotationMatrix();
        std::vector<Vec3> x, gradient(mesh.nodes.size(), Vec3::Zero());
        for (const Vec3& X : mesh.restPositions()) x.push_back(R * X);
        elastic.evaluate(x, gradient, nullptr);
        // Forces on unit faces: a stress of 1e-14 E, some 24 tets a node.
        for (const Vec3& f : gradient) EXPECT_LT(f.norm(), 24 * 1e-14 * 1e5);
    }
}

TEST(Corotational, SimpleShearMatchesClosedForm)
{
    const solver::Material m = solver::makeMaterial(1, 0.3, 1);
    const double expected[4][2] = {{.1, 1.0031192}, {.5, 1.0746437}, {1, 1.2639320}, {2, 1.7322330}};
    for (const auto& [g, ratio] : expected) {
        Mat3 F = Mat3::Identity();
        F(0, 1) = g;
        EXPECT_NEAR(solver::piolaStress(F, m)(0, 1) / (m.mu * g), ratio, 1e-7);
    }
}

TEST(Corotational, UniaxialConfinedAndHydrostaticStress)
{
    const double E = 1e5, nu = 0.3;
    for (double e : {-0.3, 0.2, 1.5}) {
        const Mat3 uniaxial = Vec3(1 + e, 1 - nu * e, 1 - nu * e).asDiagonal();
        EXPECT_NEAR(solver::piolaStress(uniaxial, kGel)(0, 0), E * e, 1e-9 * E);
        EXPECT_NEAR(solver::energyDensity(uniaxial, kGel), 0.5 * E * e * e, 1e-9 * E);
        const Mat3 confined = Vec3(1 + e, 1, 1).asDiagonal();
        EXPECT_NEAR(solver::piolaStress(confined, kGel)(0, 0), (kGel.lambda + 2 * kGel.mu) * e, 1e-9 * E);
        const double K = E / (3 * (1 - 2 * nu));
        EXPECT_NEAR(solver::piolaStress(Mat3::Identity() * (1 + e), kGel)(0, 0), 3 * K * e, 1e-9 * E);
        EXPECT_NEAR(solver::energyDensity(Mat3::Identity() * (1 + e), kGel), 4.5 * K * e * e, 1e-9 * E);
    }
}

TEST(Corotational, TwistEigenvaluesMatchReference)
{
    const solver::Material m = solver::makeMaterial(1, 0.3, 1);
    const auto sorted = [&](const Mat3& F) {
        Vec3 v = solver::twistEigenvalues(F, m) / m.mu;
        std::sort(v.data(), v.data() + 3);
        return v;
    };
    EXPECT_LT((sorted(Mat3::Identity() * .9) - Vec3::Constant(-.722222)).norm(), 2e-6);
    EXPECT_LT((sorted(Vec3(1.3, .85, .85).asDiagonal()) - Vec3(-.352941, .139535, .139535)).norm(), 2e-6);
    EXPECT_LT((sorted(Vec3(1, .5, -.2).asDiagonal()) - Vec3(-28.3333, -9.375, -4.06667)).norm(), 1e-4);
}

TEST(Corotational, StressDifferentialIsDerivativeOfStress)
{
    std::mt19937 random(9);
    for (int trial = 0; trial < 20; ++trial) {
        Mat3 F = Mat3::Identity(), dF;
        for (int c = 0; c < 3; ++c) F.col(c) += randomVec(random, 0.3), dF.col(c) = randomVec(random, 1);
        const double step = 1e-6;
        const Mat3 expected = (solver::piolaStress(F + step * dF, kGel) - solver::piolaStress(F - step * dF, kGel)) / (2 * step);
        EXPECT_LT((solver::stressDifferential(F, dF, kGel) - expected).norm(), 1e-7 * expected.norm());
    }
}

}  // namespace
