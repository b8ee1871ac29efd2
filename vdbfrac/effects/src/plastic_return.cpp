#include "plastic_return.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdbfrac::effects {

namespace {

Mat3 fromAxes(const Mat3& axes, const Vec3& values) { return axes * values.asDiagonal() * axes.transpose(); }

/// Signed singular values, rising.
Vec3 stretchesOf(const Mat3& F)
{
    const Eigen::SelfAdjointEigenSolver<Mat3> squares(F.transpose() * F, Eigen::EigenvaluesOnly);
    Vec3 s = squares.eigenvalues().cwiseMax(0).cwiseSqrt();
    if (F.determinant() < 0) s[0] = -s[0];
    return s;
}

/// |dev e|^2
double squareOfShear(const Mat3& F)
{
    const Vec3 s = stretchesOf(F);
    return (s.array() - s.mean()).square().sum();
}

/// Of a deformation that goes back: to the shear strain `left` times its own, with its volume. I where it is nearly
/// flat, or inverted: there is no log of its stretches.
struct Back {
    Mat3 axes = Mat3::Identity();
    Vec3 from = Vec3::Ones(), to = Vec3::Ones();

    Back(const Mat3& F, double left)
    {
        constexpr double kFlat = 0.05;  // of its thickness
        const Eigen::SelfAdjointEigenSolver<Mat3> squares(F.transpose() * F);
        if (!(squares.eigenvalues()[0] > kFlat * kFlat) || !(F.determinant() > 0)) return;
        axes = squares.eigenvectors(), from = squares.eigenvalues().cwiseSqrt();
        const Vec3 logs = from.array().log(), way = logs.array() - logs.mean();
        const Vec3 dev = from.array() - from.mean();
        to = (logs.mean() + timeBack(way, logs.mean(), left * dev.norm()) * way.array()).exp();
    }
    Mat3 flow() const { return fromAxes(axes, to.cwiseQuotient(from)); }

private:
    /// t with |dev exp(m + t d)| = goal; d: log of the stretches less its mean m, goal no more than at t = 1.
    static double timeBack(const Vec3& d, double m, double goal)
    {
        constexpr int kMost = 50;
        constexpr double kNear = 1e-8;  // as far as this off, Newton's method is there after one more step
        double t = 1;
        for (int i = 0; i < kMost; ++i) {
            const Vec3 s = (m + t * d.array()).exp(), dev = s.array() - s.mean();
            const double n = dev.norm(), slope = n > 0 ? dev.dot(Vec3(s.array() * d.array())) / n : 0;
            if (!(slope > 0)) return 0;
            // n rises with t, nearly straight. Between nothing and all of it.
            const double before = std::exchange(t, std::clamp(t - (n - goal) / slope, 0., 1.));
            if (std::abs(t - before) <= kNear) break;
        }
        return t;
    }
};

OfTets eachInItsOwnWay(const ElasticTets& tets, double left)
{
    std::array<std::optional<Back>, tetmesh::kMaxTets> back;
    double change = 0;  // of the mean of tr e
    for (std::size_t t = 0; t < back.size(); ++t)
        if (tets.part[t] > 0) {
            back[t].emplace(tets.F[t], left);
            change += tets.part[t] * (back[t]->to.sum() - back[t]->from.sum());
        }
    OfTets B;
    for (std::size_t t = 0; t < back.size(); ++t) {
        B[t].setIdentity();
        if (!back[t]) continue;
        const Vec3 to = back[t]->to.array() + (change - (back[t]->to.sum() - back[t]->from.sum())) / 3;
        if (to.minCoeff() > 0) back[t]->to = to;
        B[t] = back[t]->flow();
    }
    return B;
}

OfTets allInThatOfTheMean(const ElasticTets& tets, double left)
{
    OfTets B;
    B.fill(Back(tets.mean(), left).flow());
    return B;
}

}  // namespace

Mat3 ElasticTets::mean() const
{
    Mat3 sum = Mat3::Zero();
    for (std::size_t t = 0; t < part.size(); ++t)
        if (part[t] > 0) sum += part[t] * F[t];
    return sum;
}

double ElasticTets::shearStrain() const
{
    double square = meanStrain > 0 ? meanStrain * squareOfShear(mean()) : 0;
    for (std::size_t t = 0; t < part.size(); ++t)
        if (part[t] > 0) square += (1 - meanStrain) * part[t] * squareOfShear(F[t]);
    return std::sqrt(square);
}

double ElasticTets::dilation() const
{
    double sum = 0;
    for (std::size_t t = 0; t < part.size(); ++t)
        if (part[t] > 0) sum += part[t] * (stretchesOf(F[t]).sum() - 3);
    return sum;
}

ElasticTets ElasticTets::after(const OfTets& B) const
{
    ElasticTets tets = *this;
    for (std::size_t t = 0; t < part.size(); ++t)
        if (part[t] > 0) tets.F[t] = F[t] * B[t];
    return tets;
}

std::optional<PlasticReturn> plasticReturn(const ElasticTets& tets, double goal)
{
    constexpr double kNear = .01;  // of n: where the second way is worth a try
    const auto returnBy = [&](const OfTets& B) {
        const ElasticTets flowed = tets.after(B);
        return PlasticReturn{B, flowed, flowed.shearStrain()};
    };
    const double n = tets.shearStrain(), left = goal / n;
    if (!(n > 0)) return std::nullopt;
    PlasticReturn best = returnBy(eachInItsOwnWay(tets, left));
    if (best.shearStrain > goal + kNear * n)
        if (const PlasticReturn other = returnBy(allInThatOfTheMean(tets, left)); other.shearStrain < best.shearStrain)
            best = other;
    return best.shearStrain < n ? std::optional(best) : std::nullopt;
}

double boundedDilation(double now, double wanted, double largest)
{
    return std::abs(wanted) <= std::max(largest, std::abs(now)) ? wanted : std::copysign(largest, wanted);
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
    const Vec3 s = stretchesOf(F);
    return std::max(0., 2 * mu * left * (s[2] - s.mean()) + K * (s.sum() - 3));
}

}  // namespace vdbfrac::effects
