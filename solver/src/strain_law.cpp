#include "strain_law.h"

#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>

#include <cmath>

namespace vdbfrac::solver {

namespace {

/// The rotation nearest to m, a weighted mean of rotations.
Mat3 nearestRotation(const Mat3& m)
{
    constexpr double kNear = 0.3;  // Newton-Schulz converges from here, in four steps to single precision
    Mat3 R = m;
    for (int step = 0; step < 4; ++step) {
        const Mat3 off = Mat3::Identity() - R.transpose() * R;
        if (step == 0 && !(off.norm() < kNear && R.determinant() > 0)) return signedPolar(m).R;
        R += 0.5 * R * off;
    }
    return R;
}

/// S of F = R S, R a rotation, by its invariants (Hoger and Carlson 1984) where they are safe: a tenth of an SVD's
/// time.
///   I = tr S is the largest root of (x^2 - a)^2 = 2 (a^2 - b) + 8 J x,  a = tr C, b = tr C^2, J = det F, C = F^T F
///   S = (I J + (I^2 - II) C - C^2) / D,  II = (I^2 - a) / 2,  D = I II - J = (s1+s2)(s2+s3)(s3+s1)
Mat3 stretchOf(const Mat3& F)
{
    constexpr double kSafe = 1e-2;       // of |F|^3; rounding is magnified by its inverse
    constexpr double kConverged = 1e-9;  // of I: the step after it is below rounding
    const Mat3 C = F.transpose() * F, C2 = C * C;
    const double a = C.trace(), b = C2.trace(), J = F.determinant();
    double I = std::sqrt(3 * a), move = I;  // from above
    for (int step = 0; step < 30 && std::abs(move) > kConverged * I; ++step) {
        const double rest = I * I - a;
        move = (rest * rest - 2 * (a * a - b) - 8 * J * I) / (4 * I * rest - 8 * J);
        I -= move;
    }
    const double II = 0.5 * (I * I - a), D = I * II - J;
    if (!(D > kSafe * a * std::sqrt(a)) || !(J > 0)) return signedPolar(F).S;
    return (I * J * Mat3::Identity() + (I * I - II) * C - C2) / D;
}

/// R of F = R S.
Mat3 rotationOf(const Mat3& F, const Mat3& S)
{
    constexpr double kSafe = 1e-2;  // det S of a tet that is far from flat
    return S.determinant() > kSafe ? Mat3(F * S.inverse()) : signedPolar(F).R;
}

class Corotational : public StrainLaw {
public:
    Mat3 strain(const Mat3& F) const override { return stretchOf(F) - Mat3::Identity(); }
    Mat3 firstPiola(const Mat3& F, const Mat3& e, const Mat3& stress) const override
    {
        return rotationOf(F, e + Mat3::Identity()) * stress;
    }
    double minEigenvalue(double share) const override { return -(1 + share); }
    Mat3 meanRotation(const Mat3& mean) const override { return nearestRotation(mean); }
    Mat3 ofTet(const Mat3& R, const Mat3& T) const override { return R * T * R.transpose(); }
    Mat3 block(const Vec3& gi, const Vec3& gj, const Mat3& R, const Mat3& T, double mu) const override
    {
        const Vec3 qi = R * gi, qj = R * gj;
        return 2 * mu * gi.dot(gj) * Mat3::Identity() + skew(qi) * T * skew(qj).transpose();
    }
};

/// The tangent is the corotational one with R = I.
class Linear : public Corotational {
public:
    Mat3 strain(const Mat3& F) const override { return 0.5 * (F + F.transpose()) - Mat3::Identity(); }
    Mat3 firstPiola(const Mat3&, const Mat3&, const Mat3& stress) const override { return stress; }
};

/// F stands in the place of R and Sigma in that of T.
class Green : public StrainLaw {
public:
    Mat3 strain(const Mat3& F) const override { return 0.5 * (F.transpose() * F - Mat3::Identity()); }
    Mat3 firstPiola(const Mat3& F, const Mat3&, const Mat3& stress) const override { return F * stress; }
    double minEigenvalue(double) const override { return 0; }  // the rest is a square of the rate of strain
    Mat3 meanRotation(const Mat3& mean) const override { return mean; }
    Mat3 ofTet(const Mat3&, const Mat3& T) const override { return T; }
    Mat3 block(const Vec3& gi, const Vec3& gj, const Mat3& F, const Mat3& Sigma, double mu) const override
    {
        const Vec3 qi = F * gi, qj = F * gj;
        return mu * (gi.dot(gj) * F * F.transpose() + qj * qi.transpose()) + gi.dot(Sigma * gj) * Mat3::Identity();
    }
};

}  // namespace

const StrainLaw& lawOf(Strain strain)
{
    static const Corotational corotational;
    static const Linear linear;
    static const Green green;
    switch (strain) {
    case Strain::linear: return linear;
    case Strain::green: return green;
    case Strain::corotational: break;
    }
    return corotational;
}

}  // namespace vdbfrac::solver
