#include "contact_points.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>

namespace vdbfrac::effects {

std::vector<ContactPoint> ContactForces::contacts(std::span<const contact::Pair> pairs, std::span<const Vec3> x) const
{
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<ContactPoint>& all) {
        for (const contact::Pair& p : pairs.subspan(begin, end - begin)) {
            const contact::InTarget in = targets_.locate(p.target, surface_.probe(p.sample, x), x);
            const double depth = surface_.reach(p.sample) - in.phi - surface_.memory(p.sample).allowance;
            if (depth > 0) all.push_back({p.sample, p.target, depth, in.share, in.outward});
        }
    };
    return gatherChunks<ContactPoint>(pairs.size(), kChunk, add);
}

std::vector<FrictionPoint> ContactForces::friction(std::span<const ContactPoint> contacts, double mu,
                                                   std::span<const Vec3> anchor) const
{
    std::vector<FrictionPoint> all;
    for (const ContactPoint& t : contacts) {
        const double limit = mu * force(t).norm();
        if (!(limit > 0)) continue;
        const auto spring =
            contact::makeFrictionSpring(t.outward.normalized(), limit, k(t), surface_.memory(t.sample).stretch);
        contact::addStrongest(FrictionPoint{t.sample, t.target, t.share, spring, apart(t, anchor)}, all);
    }
    return all;
}

double ContactForces::evaluate(std::span<const ContactPoint> contacts, std::span<const FrictionPoint> friction,
                               std::span<const Vec3> x, std::span<Vec3> gradient) const
{
    double sum = 0;
    for (const ContactPoint& t : contacts) {
        sum += energy(t);
        add(t, force(t), gradient);
    }
    for (const FrictionPoint& h : friction) {
        const Vec3 slip = this->slip(h, x);
        sum += h.spring.energy(slip);
        add(h, h.spring.force(slip), gradient);
    }
    return sum;
}

void ContactForces::linearize(std::span<const ContactPoint> contacts, std::span<const FrictionPoint> friction,
                              std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const
{
    for (const ContactPoint& t : contacts) couplings.push_back(coupling(t, stiffness(t)));
    for (const FrictionPoint& h : friction) {
        const Vec3 slip = this->slip(h, x);
        h.spring.follow(slip, h.dual);
        couplings.push_back(coupling(h, h.spring.stiffness(slip, h.dual)));
    }
}

double knownDepth(std::uint32_t sample, const contact::ContactSurface& surface, std::span<const double> before)
{
    return std::max(before[sample], surface.memory(sample).allowance);
}

std::vector<double> withoutJumps(std::vector<double> now, std::span<const double> before, double jump,
                                 const contact::ContactSurface& surface)
{
    for (std::uint32_t i = 0; i < now.size(); ++i)
        if (now[i] > knownDepth(i, surface, before) + jump) now[i] = before[i];
    return now;
}

void allowJumps(std::span<const contact::Penetration> sunk, std::span<const ContactPoint> contacts,
                std::span<const double> before, double jump, contact::ContactSurface& surface)
{
    std::vector<double> known(before.begin(), before.end());
    for (std::uint32_t i = 0; i < known.size(); ++i) known[i] = knownDepth(i, surface, before);
    for (const ContactPoint& t : contacts)
        known[t.sample] = std::max(known[t.sample], surface.memory(t.sample).allowance + t.depth);
    for (const contact::Penetration& s : sunk)
        if (s.depth > known[s.sample] + jump) {
            surface.memory(s.sample).allowance += s.depth - known[s.sample];
            known[s.sample] = s.depth;  // it may be in several pieces
        }
}

bool hidesDeep(std::span<const ContactPoint> seen, std::span<const ContactPoint> all, double deep)
{
    auto known = seen.begin();
    for (const ContactPoint& t : all) {
        double depth = deep;
        while (known != seen.end() && known->sample < t.sample) ++known;
        for (auto k = known; k != seen.end() && k->sample == t.sample; ++k) depth = std::max(depth, k->depth + deep);
        if (t.depth > depth) return true;
    }
    return false;
}

bool cameUp(double deeper, double way, double dx)
{
    constexpr double kWay = 0.5;  // of how much deeper it is than before
    return deeper > kJump * dx && way < kWay * deeper;
}

bool isDeeper(const contact::Penetration& s, double expected, double dx) { return s.depth > expected + kJump * dx; }

bool areResisted(std::span<const contact::Penetration> sunk, std::span<const ContactPoint> contacts,
                 const contact::ContactSurface& surface, double dx)
{
    constexpr double kResists = .8;  // of a slope: in the middle of a flap there is none
    return std::ranges::all_of(sunk, [&](const contact::Penetration& s) {
        const auto own = std::ranges::equal_range(contacts, s.sample, {}, &ContactPoint::sample);
        return std::ranges::any_of(own, [&](const ContactPoint& t) {
            return t.outward.norm() > kResists && !isDeeper(s, surface.memory(t.sample).allowance + t.depth, dx);
        });
    });
}

}  // namespace vdbfrac::effects
