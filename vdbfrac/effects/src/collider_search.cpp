#include "collider_search.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

namespace vdbfrac::effects {

/// Up to kMost points in a row, at some positions of the nodes, and a ball round them.
class ColliderSearch::Group {
public:
    static constexpr std::size_t kMost = 64;

    Group(const contact::EdgedSurface& surface, std::size_t begin, std::size_t end, std::span<const Vec3> x)
        : begin_(begin), end_(end), at_(positions(surface, begin, end, x)), ball_(std::span(at_).first(end - begin))
    {
        for (std::size_t i = begin; i < end; ++i) reach_ = std::max(reach_, surface.reach(i));
    }
    std::size_t begin() const { return begin_; }
    std::size_t end() const { return end_; }
    const Vec3& at(std::size_t i) const { return at_[i - begin_]; }  // m
    const Ball& ball() const { return ball_; }
    /// No point is nearer to touching it than this [m].
    double leastRoom(const Obstacle& obstacle, const scene::Placement& place) const
    {
        return (obstacle.least(ball_, place) - reach_) / obstacle.steepest();
    }

private:
    using Positions = std::array<Vec3, kMost>;
    static Positions positions(const contact::EdgedSurface& surface, std::size_t begin, std::size_t end,
                               std::span<const Vec3> x)
    {
        Positions at;
        for (std::size_t i = begin; i < end; ++i) at[i - begin] = surface.at(i, x);
        return at;
    }

    std::size_t begin_, end_;
    Positions at_;
    Ball ball_;
    double reach_ = 0;
};

/// Calls visit(group) for the points from `begin` up to `end`.
template <class Visit>
void ColliderSearch::eachGroup(std::size_t begin, std::size_t end, std::span<const Vec3> x, const Visit& visit) const
{
    for (; begin < end; begin += Group::kMost) visit(Group(surface_, begin, std::min(end, begin + Group::kMost), x));
}

/// Is a group of nodes nearer to a collider than the way(begin, end, ball, collider) [m] they may go towards it?
template <class Way>
bool ColliderSearch::isAnyNear(std::span<const Vec3> x, const Places& places, double outside, const Way& way) const
{
    constexpr double kStretched = .5;  // of the ball round nodes: what is outside of a stretched tet goes with it
    const auto isNear = [&](std::size_t begin, std::size_t end) {
        const Ball ball(x.subspan(begin, end - begin));
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            const double room = obstacles_[c].least(ball, places[c]) / obstacles_[c].steepest();
            if (!(room > outside + kStretched * ball.radius + way(begin, end, ball, c))) return true;
        }
        return false;
    };
    return orderedMax(x.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
               bool isAny = false;
               for (; !isAny && begin < end; begin += Group::kMost)
                   isAny = isNear(begin, std::min(end, begin + Group::kMost));
               return double(isAny);
           }) > 0;
}

bool ColliderSearch::mayTouch(const Outlook& outlook, const Places& places) const
{
    constexpr double kFaster = 2;
    const std::vector<scene::RigidVelocity> carried = obstacles_.velocitiesAt(outlook.time);
    return isAnyNear(outlook.x, places, outlook.outside,
                     [&](std::size_t begin, std::size_t end, const Ball& ball, std::size_t c) {
                         double speed = 0;
                         for (std::size_t n = begin; n < end; ++n) speed = std::max(speed, outlook.v[n].norm());
                         speed += carried[c](ball.center).norm() + carried[c].spin.norm() * ball.radius;
                         return kFaster * speed * outlook.duration;
                     });
}

bool ColliderSearch::mayHaveTouched(const solver::WholeStep& way, double outside) const
{
    const Places from = obstacles_.placesAt(way.begin), to = obstacles_.placesAt(way.end);
    return isAnyNear(way.from, from, outside, [&](std::size_t begin, std::size_t end, const Ball& ball, std::size_t c) {
        double farthest = 0;
        for (std::size_t n = begin; n < end; ++n) farthest = std::max(farthest, (way.to[n] - way.from[n]).norm());
        return farthest + obstacles_.farthest(ball, c, from, to);
    });
}

std::vector<ColliderContact> ColliderSearch::contacts(std::span<const Vec3> x, const Places& places,
                                                      std::int64_t& pairs) const
{
    std::atomic<std::int64_t> looked = 0;
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<ColliderContact>& all) {
        std::int64_t own = 0;
        eachGroup(begin, end, x, [&](const Group& group) { addContacts(group, places, own, all); });
        looked += own;
    };
    std::vector<ColliderContact> all = gatherChunks<ColliderContact>(surface_.points(), kChunk, add);
    pairs += looked;
    return all;
}

void ColliderSearch::addContacts(const Group& group, const Places& places, std::int64_t& pairs,
                                 std::vector<ColliderContact>& all) const
{
    const std::size_t before = all.size();
    for (std::uint32_t c = 0; c < obstacles_.size(); ++c) {
        if (group.leastRoom(obstacles_[c], places[c]) > 0) continue;
        pairs += std::int64_t(group.end() - group.begin());
        for (std::size_t i = group.begin(); i < group.end(); ++i) {
            const Vec3 X = places[c].inverse(group.at(i));
            const double depth = surface_.reach(i) - obstacles_[c].distance(X) - surface_.allowance(i);
            if (depth > 0) all.push_back({std::uint32_t(i), c, depth, places[c].turn * obstacles_[c].gradient(X)});
        }
    }
    std::sort(all.begin() + std::ptrdiff_t(before), all.end(), isBefore);
}

std::vector<ColliderSearch::Depth> ColliderSearch::depths(std::span<const Vec3> x, const Places& places) const
{
    std::vector<Depth> depths(surface_.points());
    const auto measure = [&](const Group& group) {
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            if (group.leastRoom(obstacles_[c], places[c]) > 0) continue;
            for (std::size_t i = group.begin(); i < group.end(); ++i) {
                const double depth = surface_.reach(i) - obstacles_.distance(group.at(i), c, places);
                if (depth > depths[i].depth) depths[i] = {depth, c};
            }
        }
    };
    parallelChunks(surface_.points(), kChunk,
                   [&](std::size_t begin, std::size_t end) { eachGroup(begin, end, x, measure); });
    return depths;
}

std::vector<double> ColliderSearch::room(std::span<const Vec3> x, const Places& places) const
{
    std::vector<double> room(surface_.size(), kInfinity);
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        eachGroup(begin, end, x, [&](const Group& group) { measureRoom(group, places, room); });
    });
    return room;
}

/// The nearest colliders first, until those that are left are farther than any that was found.
void ColliderSearch::measureRoom(const Group& group, const Places& places, std::vector<double>& room) const
{
    std::vector<std::pair<double, std::size_t>> colliders;
    for (std::size_t c = 0; c < obstacles_.size(); ++c)
        colliders.emplace_back(group.leastRoom(obstacles_[c], places[c]), c);
    std::sort(colliders.begin(), colliders.end());
    double most = kInfinity;
    for (const auto& [least, c] : colliders) {
        if (least > most) return;
        most = 0;
        for (std::size_t i = group.begin(); i < group.end(); ++i) {
            const double distance = obstacles_.distance(group.at(i), c, places);
            room[i] = std::min(room[i], (distance - surface_.reach(i)) / obstacles_[c].steepest());
            most = std::max(most, room[i]);
        }
    }
}

bool ColliderSearch::isAnyPassed(const solver::WholeStep& way) const
{
    const Places from = obstacles_.placesAt(way.begin), to = obstacles_.placesAt(way.end);
    const auto isPassed = [&](const Group& group) {
        double farthest = 0;
        for (std::size_t i = group.begin(); i < group.end(); ++i)
            farthest = std::max(farthest, (surface_.at(i, way.to) - group.at(i)).norm());
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            const double own = obstacles_.farthest(group.ball(), c, from, to);
            if (obstacles_[c].least(group.ball(), from[c]) > obstacles_[c].steepest() * (farthest + own)) continue;
            for (std::size_t i = group.begin(); i < group.end(); ++i)
                if (obstacles_[c].isPassed(from[c].inverse(group.at(i)), to[c].inverse(surface_.at(i, way.to))))
                    return true;
        }
        return false;
    };
    return orderedMax(surface_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
               double any = 0;
               eachGroup(begin, end, way.from, [&](const Group& group) { any = any > 0 || isPassed(group); });
               return any;
           }) > 0;
}

double ColliderSearch::fastest(const solver::State& state, const Places& places, double time) const
{
    const std::vector<scene::RigidVelocity> carried = obstacles_.velocitiesAt(time);
    const auto raise = [&](const Group& group, double& most) {
        double speed = 0;
        for (std::size_t i = group.begin(); i < group.end(); ++i)
            speed = std::max(speed, surface_.at(i, state.v).norm());
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            const double half = obstacles_[c].halfThickness();
            if (!std::isfinite(half)) continue;
            const double relative =
                speed + carried[c](group.ball().center).norm() + carried[c].spin.norm() * group.ball().radius;
            if (relative <= most * (half + std::max(0., obstacles_[c].least(group.ball(), places[c])))) continue;
            for (std::size_t i = group.begin(); i < group.end(); ++i) {
                const double distance = std::max(0., obstacles_.distance(group.at(i), c, places));
                const Vec3 v = surface_.at(i, state.v) - carried[c](group.at(i));
                most = std::max(most, v.norm() / (half + distance));
            }
        }
    };
    return orderedMax(surface_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        eachGroup(begin, end, state.x, [&](const Group& group) { raise(group, most); });
        return most;
    });
}

}  // namespace vdbfrac::effects
