#include "strain_law.h"

#include "robust_tet.h"

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

class Corotational : public StrainLaw {
public:
    void measure(std::span<const Mat3> F, StrainsOf& strains) const override
    {
        static_assert(StrainsOf::kMost <= kLanes);
        LanePolars polars;
        for (std::size_t l = 0; l < kLanes; ++l)
            for (int k = 0; k < 9; ++k) polars.F[k][l] = l < F.size() ? F[l](k / 3, k % 3) : k % 4 == 0;
        kernel().polar(kRobust, polars);
        for (std::size_t l = 0; l < F.size(); ++l) {
            double S[6];
            for (int k = 0; k < 6; ++k) S[k] = polars.S[k][l];
            strains.e[l] = unpackSymmetric(S) - Mat3::Identity();
            for (int k = 0; k < 9; ++k) strains.A[l](k / 3, k % 3) = polars.R[k][l];
        }
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
    void measure(std::span<const Mat3> F, StrainsOf& strains) const override
    {
        for (std::size_t i = 0; i < F.size(); ++i)
            strains.e[i] = 0.5 * (F[i] + F[i].transpose()) - Mat3::Identity(), strains.A[i] = Mat3::Identity();
    }
};

/// F stands in the place of R and Sigma in that of T.
class Green : public StrainLaw {
public:
    void measure(std::span<const Mat3> F, StrainsOf& strains) const override
    {
        for (std::size_t i = 0; i < F.size(); ++i)
            strains.e[i] = 0.5 * (F[i].transpose() * F[i] - Mat3::Identity()), strains.A[i] = F[i];
    }
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
