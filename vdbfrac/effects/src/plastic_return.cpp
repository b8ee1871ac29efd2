#include "plastic_return.h"

#include <vdbfrac/solver/corotational.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace vdbfrac::effects {

namespace {

Vec3 deviatorOf(const Vec3& s) { return s.array() - s.mean(); }

Mat3 fromAxes(const Mat3& axes, const Vec3& values) { return axes * values.asDiagonal() * axes.transpose(); }

/// t with |dev exp(m + t d)| = goal; d: log of the stretches less its mean m, goal no more than at t = 1.
double timeBack(const Vec3& d, double m, double goal)
{
    constexpr int kMost = 50;
    constexpr double kRounding = 1e-15;
    double t = 1;
    for (int i = 0; i < kMost; ++i) {
        const Vec3 s = (m + t * d.array()).exp();
        const Vec3 dev = deviatorOf(s);
        const double n = dev.norm(), slope = n > 0 ? dev.dot(Vec3(s.array() * d.array())) / n : 0;
        if (!(slope > 0)) return 0;
        // n rises with t, nearly straight: Newton's method, kept between nothing and all of it.
        const double next = std::clamp(t - (n - goal) / slope, 0., 1.);
        if (std::abs(next - t) <= kRounding) return next;
        t = next;
    }
    return t;
}

}  // namespace

Mat3 PlasticReturn::flow() const { return fromAxes(axes, to.cwiseQuotient(from)); }

std::optional<PlasticReturn> plasticReturn(const Mat3& F, double left)
{
    constexpr double kFlat = 0.05;  // of its thickness
    const solver::Polar polar = solver::signedPolar(F);
    if (!(polar.s[2] > kFlat)) return std::nullopt;
    const Vec3 logs = polar.s.array().log();
    const Vec3 d = deviatorOf(logs);
    const double m = logs.mean(), t = timeBack(d, m, left * deviatorOf(polar.s).norm());
    return PlasticReturn{polar.V, polar.s, (m + t * d.array()).exp()};
}

double lessDilation(double now, double change, double largest)
{
    const double end = std::abs(now + change), same = now + change < 0 ? -now : now;
    return end > largest ? -change * (end - largest) / (end - same) : 0;
}

Mat3 symmetricFlow(const Mat3& A)
{
    const Eigen::SelfAdjointEigenSolver<Mat3> of(A * A.transpose());
    return fromAxes(of.eigenvectors(), of.eigenvalues().cwiseSqrt());
}

bool isSpent(const Mat3& A, double stretch)
{
    return std::max(A.squaredNorm(), A.inverse().squaredNorm()) >= stretch * stretch + 2 / stretch;
}

double tensionOf(const Mat3& F, double left, double mu, double K)
{
    const Vec3 s = solver::signedPolar(F).s;
    return std::max(0., 2 * mu * left * (s[0] - s.mean()) + K * (s.sum() - 3));
}

}  // namespace vdbfrac::effects
