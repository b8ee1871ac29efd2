// Each vector unit's loops against their definition, and the units against one another.
#include "../../solver/src/kernel.h"
#include "../../solver/src/robust_tet.h"

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

using namespace vdbfrac;

namespace {

/// A body of 45 nodes, the last five of a group of eight: some have one slot in a row, others none, one or two
/// anywhere.
template <class Real>
struct RandomNodes {
    static constexpr std::size_t kNodes = 45, kSlots = 120;
    std::vector<Real> slot, r, p, step;
    std::vector<float> added;
    std::vector<double> mass, u;
    std::vector<solver::LaneBlocks> B{6};
    std::vector<std::uint32_t> contiguous{solver::kNoSlot, 16, solver::kNoSlot, 64, solver::kNoSlot, solver::kNoSlot},
        start{0}, slots;

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
            const std::uint32_t first = contiguous[n / 8];
            if (first != solver::kNoSlot)
                slots.push_back(first + n % 8);
            else
                for (std::uint32_t k = 0; k < n % 3; ++k) slots.push_back((7 * n + 31 * k) % std::uint32_t(kSlots));
            start.push_back(std::uint32_t(slots.size()));
        }
    }
    solver::SlotSums<Real> sums() const { return {slot.data(), contiguous.data(), start.data(), slots.data()}; }
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

/// A patch of three batches in a random state: a row of whole cells, cut cells in any order, and cells that have
/// flowed.
struct RandomPatch {
    static constexpr int kNodes = 40, kStride = kNodes + solver::kLanes, kBatches = 3;
    solver::Batch batch[kBatches];
    solver::LaneCorners corners{};
    solver::LaneVolumes volumes{};
    solver::LaneCells flowed{};
    std::vector<double> x;

    RandomPatch()
    {
        std::mt19937 random(2);
        for (std::size_t c = 0; c < tetmesh::kCorners; ++c) batch[0].corner[c] = std::uint16_t(9 * (c / 2) + c % 2);
        batch[1].gathered = batch[1].cut = 0;
        batch[1].tangent = tetmesh::kMaxTets;
        batch[2] = {.gathered = 0, .cut = 0, .tangent = 2 * tetmesh::kMaxTets, .flowed = true};
        for (auto& lane : corners.corner)
            for (auto& corner : lane) corner = std::uint16_t(random() % kNodes);
        for (auto& tet : volumes.share)
            for (double& share : tet) share = double(random() % 3) / 6;
        std::copy_n(&volumes.share[0][0], tetmesh::kMaxTets * solver::kLanes, &flowed.share[0][0]);
        for (auto& tet : flowed.gradient)
            for (auto& vertex : tet)
                for (auto& lanes : vertex)
                    for (double& g : lanes) g = std::uniform_real_distribution<double>(-1, 1)(random);
        x.resize(3 * kStride);
        for (double& v : x) v = std::uniform_real_distribution<double>(-1, 1)(random);
    }

    /// What products and diagonal blocks of both precisions give, one after another.
    void multiply(const solver::Kernel& kernel, const solver::PatchData& d, std::vector<double>& out) const
    {
        std::vector<double> product(x.size(), 0.), diagonal(2 * x.size(), 0.);
        std::vector<float> in(x.begin(), x.end()), single(x.size(), 0.f);
        out.push_back(kernel.twice.product(d, x.data(), product.data()));
        out.push_back(kernel.single.product(d, in.data(), single.data()));
        kernel.diagonal(d, diagonal.data());
        out.insert(out.end(), product.begin(), product.end());
        out.insert(out.end(), single.begin(), single.end());
        out.insert(out.end(), diagonal.begin(), diagonal.end());
    }

    /// Gradient, energy, products with the tangents of tets and with their means over cells, passes over nodes.
    std::vector<double> run(const solver::Kernel& kernel, bool cellDilation) const
    {
        const solver::RobustTet scalar = {[](const double*, double* R, double* S) {
                                              for (int k = 0; k < 9; ++k) R[k] = k % 4 == 0;
                                              for (int k = 0; k < 6; ++k) S[k] = k < 3;
                                          },
                                          [](const double*, double t, double* T) {
                                              for (int k = 0; k < 6; ++k) T[k] = k < 3 ? t : 0;
                                          }};
        solver::TetTangent tangent[kBatches * tetmesh::kMaxTets] = {}, cells[kBatches] = {};
        std::vector<double> out(x.size(), 0.);
        solver::PatchData d;
        d.batch = batch, d.corners = &corners, d.volumes = &volumes, d.flowed = &flowed, d.tangent = tangent;
        d.batches = kBatches, d.nodes = kNodes, d.stride = kStride;
        d.h = 0.1, d.mu = 3e4, d.lambda = 5e4, d.bulk = 7e4, d.share = 0.2, d.cellDilation = cellDilation;
        const auto result = kernel.evaluate(d, scalar, x.data(), out.data());
        out.push_back(result.energy);
        multiply(kernel, d, out);
        kernel.averageTets(d, scalar, cells);
        d.cells = cells;
        multiply(kernel, d, out);
        RandomNodes<double> n;
        const solver::GradientNodes<double> nodes{n.sums(),   n.B.data(), n.mass.data(), 2.,
                                                  n.r.data(), n.p.data(), n.u.data()};
        out.push_back(kernel.twice.updateResidual(nodes, 0, n.kNodes, .3));
        out.push_back(kernel.twice.updateDirection(nodes, 0, n.kNodes, .4, .7));
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
    for (const solver::Kernel* kernel : solver::kernels()) {
        checkReadAndWrite<double>(*kernel);
        checkReadAndWrite<float>(*kernel);
    }
}

template <class Real>
void checkGradientPasses(const solver::Kernel& kernel)
{
    using Nodes = RandomNodes<Real>;
    // Sums of some ten products of order one.
    const double tolerance = 50 * double(std::numeric_limits<Real>::epsilon());
    const Real step = Real(.3), beta = Real(.7);
    Nodes after;
    const Nodes before;
    const solver::GradientNodes<Real> nodes{after.sums(),   after.B.data(), after.mass.data(), 2.,
                                            after.r.data(), after.p.data(), after.u.data()};
    const double rz = kernel.of<Real>().updateResidual(nodes, 0, Nodes::kNodes, step);
    const double pMp = kernel.of<Real>().updateDirection(nodes, 0, Nodes::kNodes, .4, beta);
    double expectedRz = 0, expectedPMp = 0;
    for (std::size_t n = 0; n < Nodes::kNodes; ++n) {
        const Vec3 p = Nodes::point(before.p, n);
        const Vec3 r = Nodes::point(before.r, n) - double(step) * (2 * before.mass[n] * p + before.sum(n)),
                   z = before.applyB(n, r);
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
    for (const solver::Kernel* kernel : solver::kernels()) {
        checkGradientPasses<double>(*kernel);
        checkGradientPasses<float>(*kernel);
    }
}

TEST(Kernel, SmootherMatchesItsDefinition)
{
    using Nodes = RandomNodes<float>;
    const Nodes before;
    for (const solver::Kernel* kernel : solver::kernels()) {
        Nodes after;  // r stands for b, p for x
        kernel->smooth(
            {after.sums(), after.B.data(), after.added.data(), after.r.data(), after.p.data(), after.step.data()}, 0,
            Nodes::kNodes, .2f, .6f);
        for (std::size_t n = 0; n < Nodes::kNodes; ++n) {
            const Vec3 x = Nodes::point(before.p, n),
                       residual = Nodes::point(before.r, n) - double(before.added[n]) * x - before.sum(n);
            const Vec3 step = double(.2f) * Nodes::point(before.step, n) + double(.6f) * before.applyB(n, residual);
            EXPECT_LT((Nodes::point(after.step, n) - step).norm(), 5e-6) << kernel->name;
            EXPECT_LT((Nodes::point(after.p, n) - x - step).norm(), 5e-6) << kernel->name;
        }
    }
}

/// Also of what is squeezed flat and turned inside out, which takes the scalar path.
TEST(Kernel, PolarDecompositionsAreThoseOfSingularValues)
{
    const auto at = [](const Mat3& m, int k) { return m(k / 3, k % 3); };
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Mat3> F(solver::kLanes);
    for (Mat3& f : F)
        for (double& v : f.reshaped()) v = unit(random);
    F[0] = Mat3::Identity(), F[1] = Vec3(1, 1, 1e-9).asDiagonal(), F[2] = Vec3(2, 1, -1).asDiagonal();
    std::vector<solver::LanePolars> found(solver::kernels().size());
    for (std::size_t unit = 0; unit < found.size(); ++unit) {
        const solver::Kernel& kernel = *solver::kernels()[unit];
        solver::LanePolars& lanes = found[unit];
        for (std::size_t l = 0; l < F.size(); ++l)
            for (int k = 0; k < 9; ++k) lanes.F[k][l] = at(F[l], k);
        kernel.polar(solver::kRobust, lanes);
        for (std::size_t l = 0; l < F.size(); ++l) {
            const solver::Polar expected = solver::signedPolar(F[l]);
            for (int k = 0; k < 9; ++k) EXPECT_NEAR(lanes.R[k][l], at(expected.R, k), 1e-12) << kernel.name << l;
            for (int k = 0; k < 6; ++k)
                EXPECT_NEAR(lanes.S[k][l], expected.S(solver::kRow[k], solver::kColumn[k]), 1e-12) << kernel.name << l;
        }
        if (unit > 1) {  // those that fuse
            EXPECT_EQ(std::memcmp(lanes.R, found[unit - 1].R, sizeof(lanes.R) + sizeof(lanes.S)), 0) << kernel.name;
        }
    }
}

/// Units that fuse multiplication and addition agree to the bit; plain code rounds twice where they round once.
TEST(Kernel, VectorUnitsThatFuseGiveTheSameBits)
{
    const std::span<const solver::Kernel* const> all = solver::kernels();
    const RandomPatch patch;
    for (bool cellDilation : {false, true}) {
        const std::vector<double> plain = patch.run(*all[0], cellDilation);
        double largest = 0;
        for (double v : plain) largest = std::max(largest, std::abs(v));
        for (std::size_t k = 1; k < all.size(); ++k) {
            const std::vector<double> fused = patch.run(*all[k], cellDilation);
            for (std::size_t i = 0; i < plain.size(); ++i)
                // The product in single precision rounds at 6e-8.
                EXPECT_NEAR(fused[i], plain[i], 1e-5 * largest) << all[k]->name;
            if (k > 1) {
                EXPECT_EQ(fused, patch.run(*all[k - 1], cellDilation)) << all[k]->name << " and " << all[k - 1]->name;
            }
        }
    }
}

}  // namespace
