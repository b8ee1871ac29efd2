#include <vdbfrac/contact/way_search.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::contact {

namespace {

constexpr double kMargin = 0.5;     // cells that a step may end beside the way it was expected to take
constexpr double kRounding = 1e-9;  // of a step, by where its frame ends: the margin has room for it

}  // namespace

bool WaySearch::look(TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x, std::span<const Vec3> v,
                     double dt)
{
    const bool isKnown = dt <= (1 + kRounding) * foundFor_ && std::ranges::equal(x, start_);
    if (isKnown && std::abs(dt - dt_) <= kRounding * dt && std::ranges::equal(v, v_)) return false;
    v_.assign(v.begin(), v.end()), dt_ = dt;
    ahead_ = Course::ahead(x, v, dt, kFarthest * h_).ends();
    ownAhead_ = Course::ahead(x, v, dt, kFarthest * h_, surface.fragmentOfNode()).ends();
    beside_ = ownBeside_ = {};
    if (isKnown) return false;
    start_.assign(x.begin(), x.end());
    foundFor_ = dt;
    surface.aim(start_);
    searches_ += near_.find(surface, targets, ways(), ownWays(), kMargin * h_);
    return true;
}

void WaySearch::lookBeside(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x)
{
    const Course course = Course::gone(start_, x, kFarthest * h_),
                 own = Course::gone(start_, x, kFarthest * h_, surface.fragmentOfNode());
    const auto strays = [&](const Course& to, const Ways& ways) { return to.farthestBeside(ways) > .5 * kMargin * h_; };
    const bool isBesideOwn = strays(own, ownWays());
    if (!isBesideOwn && !strays(course, ways())) return;
    WayBoxes all = course.boxesWith(ways());
    if (!isBesideOwn && !mayMeet(all.ways(), surface.fragmentOfNode(), kMargin * h_ + surface.farthestFelt())) return;
    beside_ = std::move(all), ownBeside_ = own.boxesWith(ownWays()), foundFor_ = -1;
    searches_ += near_.find(surface, targets, ways(), ownWays(), kMargin * h_);
}

void WaySearch::clear()
{
    near_.clear(), start_.clear(), v_.clear(), ahead_.clear(), ownAhead_.clear();
    foundFor_ = -1;
}

void WaySearch::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    clear(), near_.restoreFrom(name, archive, nodes);
}

}  // namespace vdbfrac::contact
