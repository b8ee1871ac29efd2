#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

Mat3 skew(const Vec3& w)
{
    Mat3 m;
    m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    return m;
}

namespace {

/// w with skew(w) = A - A^T.
Vec3 axialOfSkew(const Mat3& A) { return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)}; }

}  // namespace

Polar signedPolar(const Mat3& F)
{
    const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 U = svd.matrixU();
    Polar p;
    p.V = svd.matrixV();
    p.s = svd.singularValues();
    if (U.determinant() * p.V.determinant() < 0) {
        U.col(2) *= -1;
        p.s[2] *= -1;
    }
    p.R = U * p.V.transpose();
    p.S = p.V * p.s.asDiagonal() * p.V.transpose();
    return p;
}

double energyDensity(const Mat3& F, const Material& m)
{
    const Vec3 e = signedPolar(F).s - Vec3::Ones();
    return m.mu * e.squaredNorm() + 0.5 * m.lambda * e.sum() * e.sum();
}

Mat3 piolaStress(const Mat3& F, const Material& m)
{
    const Polar p = signedPolar(F);
    return 2 * m.mu * (F - p.R) + m.lambda * (p.s.sum() - 3) * p.R;
}

Mat3 twistOperator(const Polar& p, double t)
{
    Vec3 pole;
    for (int i = 0; i < 3; ++i) {
        const double sum = p.s.sum() - p.s[i];
        pole[i] = t / (std::abs(sum) < kTwistGuard ? std::copysign(kTwistGuard, sum) : sum);
    }
    return p.V * pole.asDiagonal() * p.V.transpose();
}

Mat3 stressDifferential(const Mat3& F, const Mat3& dF, const Material& m)
{
    const Polar p = signedPolar(F);
    const Mat3 A = p.R.transpose() * dF;
    const double t = m.lambda * (p.s.sum() - 3) - 2 * m.mu;
    return 2 * m.mu * dF + m.lambda * A.trace() * p.R + p.R * skew(twistOperator(p, t) * axialOfSkew(A));
}

Vec3 twistEigenvalues(const Mat3& F, const Material& m)
{
    const Vec3 s = signedPolar(F).s;
    const double t = m.lambda * (s.sum() - 3) - 2 * m.mu;
    return {2 * m.mu + 2 * t / (s[0] + s[1]), 2 * m.mu + 2 * t / (s[1] + s[2]), 2 * m.mu + 2 * t / (s[2] + s[0])};
}

}  // namespace vdbfrac::solver
