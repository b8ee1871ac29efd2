#include "plastic_return.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdbfrac::effects {

namespace {

Vec3 deviatorOf(const Vec3& s) { return s.array() - s.mean(); }

Mat3 fromAxes(const Mat3& axes, const Vec3& values) { return axes * values.asDiagonal() * axes.transpose(); }

/// t with |dev exp(m + t d)| = goal; d: log of the stretches less its mean m, goal no more than at t = 1.
double timeBack(const Vec3& d, double m, double goal)
{
    constexpr int kMost = 50;
    constexpr double kNear = 1e-8;  // as far as this off, Newton's method is there after one more step
    double t = 1;
    for (int i = 0; i < kMost; ++i) {
        const Vec3 s = (m + t * d.array()).exp(), dev = deviatorOf(s);
        const double n = dev.norm(), slope = n > 0 ? dev.dot(Vec3(s.array() * d.array())) / n : 0;
        if (!(slope > 0)) return 0;
        // n rises with t, nearly straight. Between nothing and all of it.
        const double before = std::exchange(t, std::clamp(t - (n - goal) / slope, 0., 1.));
        if (std::abs(t - before) <= kNear) break;
    }
    return t;
}

}  // namespace

Mat3 PlasticReturn::flow() const { return fromAxes(axes, to.cwiseQuotient(from)); }

std::optional<PlasticReturn> plasticReturn(const Mat3& F, double left)
{
    constexpr double kFlat = 0.05;  // of its thickness
    const Eigen::SelfAdjointEigenSolver<Mat3> squares(F.transpose() * F);
    if (!(squares.eigenvalues()[0] > kFlat * kFlat) || !(F.determinant() > 0)) return std::nullopt;
    const Vec3 s = squares.eigenvalues().cwiseSqrt(), logs = s.array().log();
    const Vec3 d = deviatorOf(logs);
    const double m = logs.mean(), t = timeBack(d, m, left * deviatorOf(s).norm());
    return PlasticReturn{squares.eigenvectors(), s, (m + t * d.array()).exp()};
}

double lessDilation(double now, double change, double largest)
{
    const double end = std::abs(now + change), same = now + change < 0 ? -now : now;
    return end > largest ? -change * (end - largest) / (end - same) : 0;
}

/// A = P Q with the rotation Q by Newton's method (Higham 1986), which is quick for an A that is nearly P.
Mat3 symmetricFlow(const Mat3& A)
{
    constexpr int kMost = 30;
    constexpr double kRounding = 1e-15;
    Mat3 Q = A;
    for (int i = 0; i < kMost; ++i) {
        const Mat3 next = .5 * (Q + Q.inverse().transpose());
        const bool isThere = (next - Q).squaredNorm() <= kRounding * kRounding;
        Q = next;
        if (isThere) break;
    }
    const Mat3 P = A * Q.transpose();
    return .5 * (P + P.transpose());
}

bool isSpent(const Mat3& A, double stretch)
{
    return std::max(A.squaredNorm(), A.inverse().squaredNorm()) >= stretch * stretch + 2 / stretch;
}

double tensionOf(const Mat3& F, double left, double mu, double K)
{
    const Eigen::SelfAdjointEigenSolver<Mat3> squares(F.transpose() * F, Eigen::EigenvaluesOnly);
    Vec3 s = squares.eigenvalues().cwiseMax(0).cwiseSqrt();  // rising; of what is inverted, the first is negative
    if (F.determinant() < 0) s[0] = -s[0];
    return std::max(0., 2 * mu * left * (s[2] - s.mean()) + K * (s.sum() - 3));
}

}  // namespace vdbfrac::effects
