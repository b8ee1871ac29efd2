// Contact points: what touches what, their forces, and what a scene says about them. Not installed.
#pragma once

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/contact/narrow_phase.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/scene/key.h>
#include <vdbfrac/solver/potential.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::effects {

inline const scene::Key kContactKeys[] = {
    {"friction", scene::Type::number, "", "Coefficient of Coulomb friction.", "0.5", 0},
    {"stiffness", scene::Type::number, "", "Contact stiffness: pressure per metre of penetration, in units of E / h.",
     "10", 0, kInfinity, true},
    {"gap", scene::Type::number, "voxels",
     "Distance kept between surfaces that touch; a large one crushes thin cut tets.", "0", 0, 1},
    {"lips",
     scene::Type::choice,
     "",
     "Where the lips of a crack touch: as_simulated, at the material that is left; or closed, where they are drawn.",
     "\"as_simulated\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"as_simulated", "closed"}},
    {"drawn",
     scene::Type::choice,
     "",
     "How pieces that overlap are drawn, as closed lips under pressure do: as_simulated, or apart.",
     "\"as_simulated\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"as_simulated", "apart"}},
    {"untangle_speed", scene::Type::number, "m/s",
     "Speed at which material that starts tangled is pushed apart; 0: never.", "0", 0},
};

/// A sample in a target.
struct ContactPoint {
    std::uint32_t sample = 0, target = 0;
    double depth = 0;  ///< beyond its allowance [m]
    std::array<double, 4> share{};
    Vec3 outward;
};

/// The strongest touch of a sample.
struct FrictionPoint {
    std::uint32_t sample = 0, target = 0;
    std::array<double, 4> share{};
    contact::FrictionSpring spring;
    Vec3 apart;  ///< m: from the point of the target to the sample, when the step began
    mutable contact::Dual dual = spring.dual();
};

/// What touches hold and do. `t`: a ContactPoint, or a FrictionPoint. Both sides sample each other, so each touch has
/// half of the penalty.
class ContactForces {
public:
    /// `beta`: stiffness of a touch over that of a cell of the size h [m]. Surface and targets have to live as long.
    ContactForces(const contact::ContactSurface& surface, const contact::Targets& targets, double beta, double h)
        : surface_(surface), targets_(targets), beta_(beta), h_(h)
    {
    }
    void start(std::span<const core::Body> bodies) { bodies_ = bodies; }

    /// Samples that are deeper than they may be, by rising sample, as `pairs` are.
    std::vector<ContactPoint> contacts(std::span<const contact::Pair> pairs, std::span<const Vec3> x) const;
    double energy(const ContactPoint& t) const { return area(t) * law(t).energy(t.depth); }             ///< J
    Vec3 force(const ContactPoint& t) const { return area(t) * law(t).pressure(t.depth) * t.outward; }  ///< N
    double k(const ContactPoint& t) const { return area(t) * law(t).k(); }                              ///< N/m, deep
    Mat3 stiffness(const ContactPoint& t) const                                                         ///< N/m
    {
        return area(t) * law(t).stiffness(t.depth) * t.outward * t.outward.transpose();
    }
    /// From the point of the target to the sample [m].
    Vec3 apart(const auto& t, std::span<const Vec3> x) const
    {
        return surface_.probe(t.sample, x) - tetmesh::EmbeddedPoint{targets_[t.target].node, t.share}.at(x);
    }
    /// What samples rub on: the target that pushes each most. `anchor`: where nodes were as the step began [m].
    std::vector<FrictionPoint> friction(std::span<const ContactPoint> contacts, double mu,
                                        std::span<const Vec3> anchor) const;
    Vec3 slip(const FrictionPoint& f, std::span<const Vec3> x) const { return f.spring.slip(apart(f, x) - f.apart); }
    /// J, of all touches; adds their gradient [N].
    double evaluate(std::span<const ContactPoint> contacts, std::span<const FrictionPoint> friction,
                    std::span<const Vec3> x, std::span<Vec3> gradient) const;
    void linearize(std::span<const ContactPoint> contacts, std::span<const FrictionPoint> friction,
                   std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const;
    /// gradient -= what a force [N] on a sample, and its opposite on a target, do at the nodes.
    void add(const auto& t, const Vec3& force, std::span<Vec3> gradient) const
    {
        surface_.addForce(t.sample, force, gradient);
        for (std::size_t a = 0; a < 4; ++a) gradient[targets_[t.target].node[a]] += t.share[a] * force;
    }
    /// Q [N/m]: of the way of the sample against the target.
    solver::Coupling coupling(const auto& t, const Mat3& Q) const
    {
        solver::Coupling c;
        surface_.couple(t.sample, c);
        for (std::size_t a = 0; a < 4; ++a)
            c.node[4 + a] = targets_[t.target].node[a], c.weight[4 + a] = -float(t.share[a]);
        c.Q = contact::blockOf(Q);
        return c;
    }

private:
    double area(const ContactPoint& t) const { return 0.5 * surface_.area(t.sample); }
    contact::Penalty law(const ContactPoint& t) const
    {
        const double a = youngsModulus(surface_.body(t.sample)), b = youngsModulus(targets_[t.target].body);
        return contact::penaltyOf(beta_, 2 * a * b / (a + b), h_);
    }
    double youngsModulus(std::size_t body) const { return bodies_[body].material.youngsModulus(); }

    const contact::ContactSurface& surface_;
    const contact::Targets& targets_;
    std::span<const core::Body> bodies_;
    double beta_, h_;
};

constexpr double kDepth = 2;         // voxels below the surface in which samples are found
constexpr double kGrowth = 4;        // of a step over the last one
constexpr double kLeast = 1. / 256;  // of the longest step: so far is looked ahead, however short the last one was
constexpr double kReach = 0.1;       // how far outside of its tet a sample may be, in barycentric coordinates
// Voxels: what pieces may overlap by in the scenes that were measured, half of it, and how much deeper a step may end.
constexpr double kDeep = 0.2, kHidden = kDeep / 2, kJump = kDeep / 4;
// Voxels: phi of tets that are crushed, turned or folded jumps from one to the next, and means nothing far outside of
// them. No sample really goes this much deeper than it was known to be in a step; pushed out from there, it would be
// thrown, with energy that nobody has put in.
constexpr double kThrown = 1;

/// m: what a sample may be or was when the step began; `before`: of each sample.
double knownDepth(std::uint32_t sample, const contact::ContactSurface& surface, std::span<const double> before);

/// How deep samples are `now` [m], but for those that are deeper by more than `jump` [m] than they were known to be
/// as the step began, `before` [m]. A second stage sets off from where the first has been extrapolated to: they have
/// not gone there.
std::vector<double> withoutJumps(std::vector<double> now, std::span<const double> before, double jump,
                                 const contact::ContactSurface& surface);

/// Samples that are deeper by more than `jump` [m] than they were known to be, and than what touches have resisted, are
/// allowed the excess.
void allowJumps(std::span<const contact::Penetration> sunk, std::span<const ContactPoint> contacts,
                std::span<const double> before, double jump, contact::ContactSurface& surface);

/// Is a touch more than `deep` [m] deeper than those that were seen of its sample? Both by rising sample.
bool hidesDeep(std::span<const ContactPoint> seen, std::span<const ContactPoint> all, double deep);

/// A sample may be in material of its own fragment that it does not touch, as it was beside it at rest. Where it comes
/// out of that into what it does touch, it is `deeper` [m] without having gone there. `way` [m]: that it has gone.
bool cameUp(double deeper, double way, double dx);

/// By more than a step may end.
bool isDeeper(const contact::Penetration& s, double expected, double dx);

/// Are all where touches that resist let them be? `contacts` by rising sample.
bool areResisted(std::span<const contact::Penetration> sunk, std::span<const ContactPoint> contacts,
                 const contact::ContactSurface& surface, double dx);

}  // namespace vdbfrac::effects
