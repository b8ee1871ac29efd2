#include <vdbfrac/solver/conjugate_gradient.h>

#include <vdbfrac/base/parallel.h>

#include <cmath>

namespace vdbfrac::solver {

namespace {

/// z = B r, returns r.z. Zero at fixed nodes.
double precondition(const LinearSystem& system, std::span<const Vec3> r, std::span<Vec3> z)
{
    return orderedSum(r.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            z[i] = system.fixed[i] ? Vec3::Zero().eval() : (system.inverseDiagonal[i] * r[i]).eval();
            sum += r[i].dot(z[i]);
        }
        return sum;
    });
}

/// u += a p, r -= a q, z = B r; returns r.z.
double advance(const LinearSystem& system, double a, std::span<const Vec3> p, std::span<const Vec3> q, std::span<Vec3> u,
               std::span<Vec3> r, std::span<Vec3> z)
{
    return orderedSum(u.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            if (system.fixed[i]) continue;
            u[i] += a * p[i];
            r[i] -= a * q[i];
            z[i] = system.inverseDiagonal[i] * r[i];
            sum += r[i].dot(z[i]);
        }
        return sum;
    });
}

}  // namespace

double dot(std::span<const Vec3> a, std::span<const Vec3> b)
{
    return orderedSum(a.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += a[i].dot(b[i]);
        return sum;
    });
}

LinearReport solveConjugateGradient(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u, LinearLimits limits)
{
    const std::size_t n = b.size();
    std::vector<Vec3> r(b.begin(), b.end()), z(n, Vec3::Zero()), q(n);
    parallelChunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            u[i].setZero();
            if (system.fixed[i]) r[i].setZero();
        }
    });
    double rz = precondition(system, r, z);
    std::vector<Vec3> p = z;
    const double goal = limits.tolerance * limits.tolerance * rz;
    LinearReport report;
    while (rz > goal) {
        if (report.iterations == limits.iterations) {
            report.status = LinearStatus::capped;
            return report;
        }
        system.product(p, q);
        ++report.iterations;
        const double curvature = dot(p, q);  // p is 0 at fixed nodes
        if (!(curvature > 0)) {
            report.status = LinearStatus::negativeCurvature;
            return report;
        }
        const double rzNew = advance(system, rz / curvature, p, q, u, r, z);
        const double beta = rzNew / rz;
        parallelChunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) p[i] = z[i] + beta * p[i];
        });
        rz = rzNew;
    }
    return report;
}

}  // namespace vdbfrac::solver
