#include <vdbfrac/contact/way_search.h>

#include <algorithm>

namespace vdbfrac::contact {

namespace {

constexpr double kMargin = 0.5;  // cells that a step may end beside the way it was expected to take

}  // namespace

bool WaySearch::look(TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x, std::span<const Vec3> v,
                     double dt)
{
    ahead_ = contact::ahead(x, v, dt, kFarthest * h_);
    const std::vector<Vec3> own = contact::ahead(x, v, dt, kFarthest * h_, surface.fragmentOfNode());
    ways_.set(x, ahead_), ownWays_.set(x, own);
    if (dt <= foundFor_ && std::ranges::equal(x, start_)) return false;
    start_.assign(x.begin(), x.end());
    foundFor_ = dt;
    surface.aim(start_);
    searches_ += near_.find(surface, targets, {start_, ahead_}, {start_, own}, kMargin * h_);
    return true;
}

void WaySearch::lookBeside(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x)
{
    const std::vector<Vec3> there = wayTo(start_, x, kFarthest * h_),
                            own = wayTo(start_, x, kFarthest * h_, surface.fragmentOfNode());
    const auto strays = [&](const WayBoxes& ways, std::span<const Vec3> to) {
        return ways.farthestBeside(to) > .5 * kMargin * h_;
    };
    const bool isBesideOwn = strays(ownWays_, own);
    if (!isBesideOwn && !strays(ways_, there)) return;
    WayBoxes all = ways_;
    all.add(there);
    if (!isBesideOwn && !mayMeet({all.low, all.high}, surface.fragmentOfNode(), kMargin * h_ + surface.farthestFelt()))
        return;
    ways_ = std::move(all), ownWays_.add(own), foundFor_ = -1;
    searches_ += near_.find(surface, targets, {ways_.low, ways_.high}, {ownWays_.low, ownWays_.high}, kMargin * h_);
}

void WaySearch::clear()
{
    near_.clear(), start_.clear(), ahead_.clear();
    foundFor_ = -1;
}

void WaySearch::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    clear(), near_.restoreFrom(name, archive, nodes);
}

}  // namespace vdbfrac::contact
