// What a touch costs: the energies of contact and friction that bodies and colliders share.
//
// Contact is a penalty on the depth s of a sample of the surface, an energy per area. It is finite at any depth, so a
// step may start from tangled material. With k = beta E / h the depth under a pressure p is (p / E) / beta of a cell:
// 1 / beta of the strain of the cell beside it, below what the cells resolve.
// Friction is elastic slip: a touch sticks as on a spring as stiff as contact itself, and slides where that is
// stretched to its limit. What it is stretched by lives on from step to step, so what sticks does not creep (Mindlin
// 1949 for the picture; the smooth step between both as in Li et al. 2020, Incremental Potential Contact, section 5.2).
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/coupling.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::contact {

/// Energy [J/m^2] of a depth s [m]: k s^3 / (6 s1) up to s1, k ((s - s1/2)^2 / 2 + s1^2 / 24) beyond.
class Penalty {
public:
    /// k [Pa/m], s1 [m].
    Penalty(double k, double s1) : k_(k), s1_(s1) {}

    double energy(double s) const
    {
        if (s <= 0) return 0;
        const double d = s - s1_ / 2;
        return s <= s1_ ? k_ * s * s * s / (6 * s1_) : k_ * (d * d / 2 + s1_ * s1_ / 24);
    }
    double pressure(double s) const  ///< Pa
    {
        return s <= 0 ? 0 : s <= s1_ ? k_ * s * s / (2 * s1_) : k_ * (s - s1_ / 2);
    }
    double stiffness(double s) const { return s <= 0 ? 0 : k_ * std::min(1., s / s1_); }  ///< Pa/m
    double k() const { return k_; }

private:
    double k_, s1_;
};

/// The force of friction over its limit, w, as Newton's method has it: rho w = t is solved along with the rest, where w
/// = t / rho would be put in. A slip t that is far from where it comes to lie is then no longer taken for one that goes
/// on in its direction (Chan, Golub, Mulet 1999, section 3, for total variation).
struct Dual {
    Vec3 w = Vec3::Zero();   ///< at most 1
    Vec3 at = Vec3::Zero();  ///< m: slip that it was last brought up to
};

/// One touch that may slide.
struct FrictionSpring {
    Vec3 normal;       ///< unit length
    double limit = 0;  ///< friction coefficient times normal force [N]
    double eps = 0;    ///< slip [m] at which it slides
    Vec3 stretch;      ///< m: elastic slip from the steps before

    Vec3 push() const { return limit * normal; }
    /// Holds more [N], as stiff as before.
    void strengthen(double more) { eps *= 1 + more / limit, limit += more; }
    /// Slip along the surface, with what there was; `u`: way since the step began [m].
    Vec3 slip(const Vec3& u) const
    {
        const Vec3 t = u + stretch;
        return t - normal.dot(t) * normal;
    }
    double energy(const Vec3& slip) const  ///< J
    {
        const double r = slip.norm();
        return limit * (r < eps ? r * r / eps - r * r * r / (3 * eps * eps) + eps / 3 : r);
    }
    Vec3 force(const Vec3& slip) const  ///< N, against it
    {
        return -limit / rhoOf(slip.norm()) * slip;
    }
    /// Of a slip of size r: over rho it is the force over its limit. With its derivative.
    double rhoOf(double r) const { return r < eps ? eps * eps / (2 * eps - r) : r; }
    double slopeOf(double r) const { return r < eps ? std::pow(eps / (2 * eps - r), 2) : 1; }
    /// Near its second derivative, and positive semidefinite [N/m]: see Dual.
    Mat3 stiffness(const Vec3& slip, const Dual& dual) const
    {
        const Mat3 P = Mat3::Identity() - normal * normal.transpose();
        const double r = slip.norm(), rho = rhoOf(r);
        if (!(r > 0)) return limit / rho * P;
        const Mat3 mixed = slopeOf(r) / r * dual.w * slip.transpose();
        return limit / rho * (P - 0.5 * (mixed + mixed.transpose()));
    }
    /// As a step begins: what was stretched goes on to be.
    Dual dual() const
    {
        const Vec3 slip = this->slip(Vec3::Zero());
        return {slip / rhoOf(slip.norm()), slip};
    }
    /// Takes w along to a new slip.
    void follow(const Vec3& slip, Dual& dual) const
    {
        const double r = dual.at.norm(), rho = rhoOf(r);
        const Vec3 turn = slip - dual.at;
        dual.w = (slip - (r > 0 ? slopeOf(r) / r * dual.at.dot(turn) : 0) * dual.w) / rho;
        dual.w /= std::max(1., dual.w.norm());
        dual.at = slip;
    }
    /// What it stays stretched by after the step.
    Vec3 kept(const Vec3& slip) const
    {
        const double r = slip.norm();
        return r > eps ? Vec3(eps / r * slip) : slip;
    }
};

/// Of a touch: k = beta E / h, beta [1] as a scene gives it.
inline Penalty penaltyOf(double beta, double youngsModulus, double h)
{
    constexpr double kSmooth = 0.02;  // of a cell: how deep a touch sets in
    return {beta * youngsModulus / h, kSmooth * h};
}

/// Of force limit `limit` [N] and stiffness `k` [N/m]. The force of a small slip grows with 2 limit / eps = k.
inline FrictionSpring makeFrictionSpring(const Vec3& normal, double limit, double k, const Vec3& stretch)
{
    return {normal, limit, 2 * limit / k, stretch};
}

/// Adds what a sample rubs on to those that are known, by rising sample: of several the one that holds most, with what
/// the others hold as far as they push the same way. Solids that overlap share the push.
template <class FrictionPoint>
void addStrongest(FrictionPoint held, std::vector<FrictionPoint>& all)
{
    if (all.empty() || all.back().sample != held.sample) return all.push_back(held);
    if (held.spring.limit > all.back().spring.limit) std::swap(held, all.back());
    FrictionSpring& strongest = all.back().spring;
    strongest.strengthen(held.spring.limit * std::max(0., strongest.normal.dot(held.spring.normal)));
}

/// Do two lists, by rising sample, differ in what they say of samples by `forceOf`, by so much that it is worth solving
/// on?
template <class T, class ForceOf>
bool haveChanged(std::span<const T> before, std::span<const T> now, const ForceOf& forceOf)
{
    constexpr double kChanged = 0.02;  // of all forces
    double all = 0, change = 0;
    for (auto a = before.begin(), b = now.begin(); a != before.end() || b != now.end();) {
        const std::uint32_t sample = std::min(a != before.end() ? a->sample : ~0u, b != now.end() ? b->sample : ~0u);
        Vec3 difference = Vec3::Zero();
        for (; a != before.end() && a->sample == sample; ++a) difference -= forceOf(*a);
        for (; b != now.end() && b->sample == sample; ++b) difference += forceOf(*b), all += forceOf(*b).norm();
        change += difference.norm();
    }
    return change > kChanged * all;
}

inline solver::SymmetricBlock blockOf(const Mat3& Q)
{
    return {float(Q(0, 0)), float(Q(1, 1)), float(Q(2, 2)), float(Q(1, 2)), float(Q(2, 0)), float(Q(0, 1))};
}

}  // namespace vdbfrac::contact
