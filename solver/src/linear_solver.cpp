#include <vdbfrac/solver/linear_solver.h>

#include "assembly.h"
#include "block_diagonal.h"
#include "multigrid.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/CholmodSupport>

#include <cmath>

namespace vdbfrac::solver {

namespace {

template <class F>
double nodeSum(std::size_t count, const F& term)
{
    return orderedSum(count, kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += term(i);
        return sum;
    });
}

/// Preconditioners of conjugate gradients. start(i, r) is what node i adds to r.z when its r changes, finish() the rest of
/// r.z, z(i, r) the result at node i.
class BlockJacobi {
public:
    explicit BlockJacobi(std::span<const SymmetricBlock> inverse) : inverse_(inverse) {}
    double start(std::size_t i, const Vec3& r) const { return r.dot(inverse_[i] * r); }
    double finish(std::span<const Vec3>) const { return 0; }
    Vec3 z(std::size_t i, const Vec3& r) const { return inverse_[i] * r; }

private:
    std::span<const SymmetricBlock> inverse_;
};

class VCycle {
public:
    /// `scale` brings r into the range of single precision.
    VCycle(Multigrid& multigrid, double scale)
        : multigrid_(multigrid), rightSide_(multigrid.rightSide()), result_(multigrid.result()), scale_(scale)
    {
    }
    double start(std::size_t i, const Vec3& r) const
    {
        rightSide_[i] = (scale_ * r).cast<float>();
        return 0;
    }
    double finish(std::span<const Vec3> r) const
    {
        multigrid_.apply();
        return nodeSum(r.size(), [&](std::size_t i) { return r[i].dot(z(i, r[i])); });
    }
    Vec3 z(std::size_t i, const Vec3&) const { return result_[i].cast<double>() / scale_; }

private:
    Multigrid& multigrid_;
    std::span<Vec3f> rightSide_;
    std::span<const Vec3f> result_;
    double scale_;
};

struct Vectors {
    std::vector<Vec3> r, p;
};

/// The product leaves its sums in the slots of the patches and p.K p behind, so that an iteration passes over the nodes
/// twice: r with its part of r.z, then u and p with p.M p.
template <class Preconditioner>
LinearReport conjugateGradient(const LinearSystem& A, const Preconditioner& B, std::span<const Vec3> b, std::span<Vec3> u,
                               LinearLimits limits, Vectors& v)
{
    const std::size_t n = b.size();
    const std::span<const double> mass = A.elastic.mass();
    double rz = nodeSum(n, [&](std::size_t i) {
        u[i].setZero();
        v.r[i] = A.fixed[i] ? Vec3::Zero().eval() : b[i];
        return B.start(i, v.r[i]);
    });
    rz += B.finish(v.r);
    double pMp = nodeSum(n, [&](std::size_t i) {
        v.p[i] = A.fixed[i] ? Vec3::Zero().eval() : B.z(i, v.r[i]);
        return mass[i] * v.p[i].squaredNorm();
    });
    LinearReport report;
    for (const double goal = limits.tolerance * limits.tolerance * rz; rz > goal;) {
        if (report.iterations == limits.iterations) {
            report.status = LinearStatus::capped;
            break;
        }
        const double curvature = A.elastic.multiply<Vec3>(A.tangent, v.p) + A.massFactor * pMp;
        ++report.iterations;
        if (!(curvature > 0)) {
            report.status = LinearStatus::negativeCurvature;
            break;
        }
        const auto Kp = A.elastic.sums<Vec3>();
        const double step = rz / curvature;
        double rzNew = nodeSum(n, [&](std::size_t i) {
            if (A.fixed[i]) return 0.;
            v.r[i] -= step * (A.massFactor * mass[i] * v.p[i] + Kp(i));
            return B.start(i, v.r[i]);
        });
        rzNew += B.finish(v.r);
        const double beta = rzNew / rz;
        rz = rzNew;
        pMp = nodeSum(n, [&](std::size_t i) {
            if (A.fixed[i]) return 0.;
            u[i] += step * v.p[i];
            v.p[i] = B.z(i, v.r[i]) + beta * v.p[i];
            return mass[i] * v.p[i].squaredNorm();
        });
    }
    if (!(rz >= 0)) report.status = LinearStatus::negativeCurvature;
    return report;
}

struct Direct {
    Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> factor;
    std::vector<std::uint8_t> fixed;  // of the analysed pattern
};

}  // namespace

struct LinearSolver::Data {
    const ElasticOperator& elastic;
    LinearMethod method;
    Vectors vectors;
    std::vector<SymmetricBlock> inverse;
    std::vector<Mat3> scratch;
    std::unique_ptr<Multigrid> multigrid;
    std::unique_ptr<Direct> direct;
};

LinearSolver::LinearSolver(const ElasticOperator& elastic, LinearMethod method)
    : data_(std::make_unique<Data>(Data{elastic, method, {}, {}, {}, nullptr, nullptr}))
{
}
LinearSolver::~LinearSolver() = default;
LinearSolver::LinearSolver(LinearSolver&&) noexcept = default;
LinearSolver& LinearSolver::operator=(LinearSolver&&) noexcept = default;

LinearReport LinearSolver::solve(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u, LinearLimits limits)
{
    Data& d = *data_;
    d.vectors.r.resize(b.size());
    d.vectors.p.resize(b.size());
    const LinearMethod method = d.method == LinearMethod::automatic ? LinearMethod::jacobi : d.method;
    if (method == LinearMethod::direct) return solveDirectly(system, b, u);
    LinearReport report;
    if (method == LinearMethod::multigrid) {
        if (!d.multigrid) d.multigrid = std::make_unique<Multigrid>(d.elastic);
        if (d.multigrid->setUp(system)) {
            const double size = std::sqrt(dot(b, b));
            report = conjugateGradient(system, VCycle(*d.multigrid, size > 0 ? 1 / size : 1), b, u, limits, d.vectors);
            report.method = method;
            return report;
        }
    }
    d.inverse.resize(b.size());
    invertDiagonal(system, {}, d.scratch, d.inverse);
    return conjugateGradient(system, BlockJacobi(d.inverse), b, u, limits, d.vectors);
}

LinearReport LinearSolver::solveDirectly(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u)
{
    Data& d = *data_;
    LinearReport report{LinearStatus::converged, LinearMethod::direct, 1};
    const Eigen::SparseMatrix<double> A = assemble(system, {});
    if (!d.direct) d.direct = std::make_unique<Direct>();
    if (!std::equal(system.fixed.begin(), system.fixed.end(), d.direct->fixed.begin(), d.direct->fixed.end())) {
        d.direct->factor.analyzePattern(A);
        d.direct->fixed.assign(system.fixed.begin(), system.fixed.end());
    }
    d.direct->factor.factorize(A);
    if (d.direct->factor.info() != Eigen::Success) {
        report.status = LinearStatus::negativeCurvature;
        std::fill(u.begin(), u.end(), Vec3::Zero());
        return report;
    }
    Eigen::VectorXd v(Eigen::Index(3 * b.size()));
    for (std::size_t i = 0; i < b.size(); ++i) v.segment<3>(Eigen::Index(3 * i)) = system.fixed[i] ? Vec3::Zero().eval() : b[i];
    v = d.direct->factor.solve(v);
    for (std::size_t i = 0; i < b.size(); ++i) u[i] = v.segment<3>(Eigen::Index(3 * i));
    return report;
}

std::size_t LinearSolver::bytes() const
{
    const Data& d = *data_;
    const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return of(d.vectors.r) + of(d.vectors.p) + of(d.inverse) + of(d.scratch) + (d.multigrid ? d.multigrid->bytes() : 0);
}

double dot(std::span<const Vec3> a, std::span<const Vec3> b)
{
    return nodeSum(a.size(), [&](std::size_t i) { return a[i].dot(b[i]); });
}

}  // namespace vdbfrac::solver
