#include <vdbfrac/contact/contact_search.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::contact {

namespace {

constexpr double kMargin = 0.5;     // cells that a step may end beside the way it was expected to take
constexpr double kShorter = 0.5;    // of the step for which pairs were listed: they are listed anew
constexpr double kRounding = 1e-9;  // of a step, by where its frame ends: the margin has room for it

}  // namespace

bool ContactSearch::look(ContactSurface& surface, const Targets& targets, std::span<const Vec3> x,
                         std::span<const Vec3> v, double dt)
{
    const bool isKnown = dt <= (1 + kRounding) * foundFor_ && std::ranges::equal(x, start_);
    if (isKnown && std::abs(dt - dt_) <= kRounding * dt && std::ranges::equal(v, v_)) return false;
    v_.assign(v.begin(), v.end()), dt_ = dt;
    ahead_ = RelativeMotion::ahead(x, v, dt, kFarthest * h_).ends();
    ownAhead_ = RelativeMotion::ahead(x, v, dt, kFarthest * h_, surface.fragmentOfNode()).ends();
    beside_ = ownBeside_ = {};
    if (isKnown && dt <= kShorter * foundFor_) {  // much of what was found lies beyond this step
        foundFor_ = dt;
        near_.list(surface, targets, motion(), ownMotion(), kMargin * h_);
    }
    if (isKnown) return false;
    start_.assign(x.begin(), x.end());
    foundFor_ = dt;
    surface.aimProbes(start_);
    searches_ += near_.find(surface, targets, motion(), ownMotion(), kMargin * h_);
    return true;
}

void ContactSearch::lookBeside(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x)
{
    const RelativeMotion course = RelativeMotion::gone(start_, x, kFarthest * h_),
                         own = RelativeMotion::gone(start_, x, kFarthest * h_, surface.fragmentOfNode());
    const auto strays = [&](const RelativeMotion& to, const Motion& motion) {
        return to.farthestBeside(motion) > .5 * kMargin * h_;
    };
    const bool isBesideOwn = strays(own, ownMotion());
    if (!isBesideOwn && (surface.isOneFragment() || !strays(course, motion()))) return;
    MotionBoxes all = course.boxesWith(motion());
    if (!isBesideOwn && !mayMeet(all.motion(), surface.fragmentOfNode(), kMargin * h_ + surface.farthestProbe()))
        return;
    beside_ = std::move(all), ownBeside_ = own.boxesWith(ownMotion()), foundFor_ = -1;
    searches_ += near_.find(surface, targets, motion(), ownMotion(), kMargin * h_);
}

void ContactSearch::clear()
{
    near_.clear(), start_.clear(), v_.clear(), ahead_.clear(), ownAhead_.clear();
    foundFor_ = -1;
}

void ContactSearch::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    clear(), near_.restoreFrom(name, archive, nodes);
}

}  // namespace vdbfrac::contact
