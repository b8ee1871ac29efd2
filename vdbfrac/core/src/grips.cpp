#include "grips.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/scene/placement.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <ranges>

namespace vdbfrac::core {

namespace {

/// A node counts as inside a region up to this fraction of a cell beyond it: regions that end on a lattice plane hold
/// it.
constexpr double kRegionSlack = 1e-3;

struct PlacementAt {
    double time;
    scene::Placement operator()(const scene::Force&) const { return {}; }
    template <class Move>
    scene::Placement operator()(const Move& move) const
    {
        return scene::placementAt(move, time);
    }
};

/// x1 = turn x0 + shift for what a grip holds.
struct MotionBetween {
    double t0, t1;
    using Motion = std::pair<Mat3, Vec3>;
    Motion operator()(const scene::Velocity& move) const { return {Mat3::Identity(), (t1 - t0) * move.velocity}; }
    Motion operator()(const scene::Keys& move) const
    {
        const scene::Placement from = scene::placementAt(move, t0), to = scene::placementAt(move, t1);
        const Mat3 turn = to.turn * from.turn.transpose();
        return {turn, move.pivot + to.shift - turn * (move.pivot + from.shift)};
    }
    Motion operator()(const scene::Force&) const { return {Mat3::Identity(), Vec3::Zero()}; }
};

struct StartVelocity {
    const Vec3& X;
    Vec3 operator()(const scene::Force&) const { return Vec3::Zero(); }
    template <class Move>
    Vec3 operator()(const Move& move) const
    {
        return scene::velocityAt(move, 0)(scene::placementAt(move, 0)(X));
    }
};

/// Distance [m] that a region is away, at least, from all of some points: from their bounding sphere.
double minDistance(const Primitive& region, std::span<const Vec3> points)
{
    Vec3 lower = points[0], upper = points[0];
    for (const Vec3& X : points) lower = lower.cwiseMin(X), upper = upper.cwiseMax(X);
    return signedDistance(region, 0.5 * (lower + upper)) - 0.5 * (upper - lower).norm();
}

Vec3 forceAt(const scene::Force& move, double time)
{
    return move.ramp > 0 ? (move.force * std::min(1., time / move.ramp)).eval() : move.force;
}

}  // namespace

Simulation::Grips::Grips(const std::vector<scene::Grip>& grips, double fps, std::span<const Body> bodies)
    : grips_(grips), mostJump_(.5 * bodies[0].mesh->spacing()), soon_(1e-4 / fps)
{
    for (const scene::Grip& grip : grips_) {
        const auto body =
            std::find_if(bodies.begin(), bodies.end(), [&](const Body& b) { return b.name == grip.body; });
        if (body == bodies.end())
            throw InputError({"grip '" + grip.name + "'", "its body '" + grip.body + "' is not in the scene", "", ""});
        held_.push_back({&grip, std::size_t(body - bodies.begin()), {}, {}, {}});
        // The body is at rest at first: what only holds it pulls at nothing.
        if (const auto* force = std::get_if<scene::Force>(&grip.move)) held_.back().before.force = forceAt(*force, 0);
    }
    for (const Body& body : bodies) bodyNames_.push_back(body.name);
}

void Simulation::Grips::rebuild(std::span<const Body> bodies, const solver::ElasticOperator& elastic)
{
    constexpr std::size_t kNear = 256;  // nodes in a row: they are neighbours, most rows are far from a grip
    std::vector<std::vector<Vec3>> rest(bodies.size());
    for (Held& held : held_) {
        const Body& body = bodies[held.body];
        const double slack = kRegionSlack * body.mesh->spacing();
        held.nodes.clear(), held.rest.clear(), held.share.clear();
        if (held.isGone) continue;
        std::vector<Vec3>& all = rest[held.body];
        if (all.empty()) all = tetmesh::restPositions(*body.mesh);
        double mass = 0;
        for (std::size_t begin = 0; begin < all.size(); begin += kNear) {
            const std::size_t end = std::min(all.size(), begin + kNear);
            if (minDistance(held.grip->region, std::span(all).subspan(begin, end - begin)) > 2 * slack) continue;
            for (std::size_t i = begin; i < end; ++i) {
                if (signedDistance(held.grip->region, all[i]) > slack) continue;
                held.nodes.push_back(body.firstNode + std::uint32_t(i));
                held.rest.push_back(all[i]);
                held.share.push_back(elastic.mass()[body.firstNode + i]);
                mass += held.share.back();
            }
        }
        for (double& s : held.share) s /= mass;
    }
    boundary_.fixed.assign(elastic.nodeCount(), 0);
    boundary_.target.assign(elastic.nodeCount(), Vec3::Zero());
    for (auto held = held_.rbegin(); held != held_.rend(); ++held) {
        if (std::holds_alternative<scene::Force>(held->grip->move)) continue;
        for (std::size_t i = 0; i < held->nodes.size(); ++i) {
            held->share[i] = boundary_.fixed[held->nodes[i]] ? 0 : 1;
            boundary_.fixed[held->nodes[i]] = 1;
        }
    }
    boundary_.force.assign(elastic.nodeCount(), Vec3::Zero());
    boundary_.part.clear();
    for (const Body& body : bodies)
        boundary_.part.insert(boundary_.part.end(), body.fragments.ofNode().begin(), body.fragments.ofNode().end());
}

void Simulation::Grips::requireNodes(double end) const
{
    for (const Held& held : held_)
        if (held.nodes.empty())
            throw InputError({held.grip->place,
                              "grip '" + held.grip->name + "' holds nothing of body '" + held.grip->body + "'",
                              "a region that contains lattice nodes of the body", "move or enlarge the region"});
    for (auto other = held_.begin(); other != held_.end(); ++other)
        if (other->grip->until && *other->grip->until < end) requireHandOver(*other, std::span(held_.begin(), other));
}

/// Nodes that a grip lets go are held by the last of the grips before it that have them.
void Simulation::Grips::requireHandOver(const Held& from, std::span<const Held> before) const
{
    const double time = *from.grip->until;
    if (std::holds_alternative<scene::Force>(from.grip->move)) return;
    const scene::Placement left = std::visit(PlacementAt{time}, from.grip->move);
    for (std::size_t i = 0; i < from.nodes.size(); ++i) {
        if (from.share[i] == 0) continue;  // a later one moves it
        for (const Held& to : before | std::views::reverse) {
            if (std::holds_alternative<scene::Force>(to.grip->move) || isDue(to, time)) continue;
            if (!std::ranges::binary_search(to.nodes, from.nodes[i])) continue;
            const Vec3& X = from.rest[i];
            const double jump = (std::visit(PlacementAt{time}, to.grip->move)(X) - left(X)).norm();
            if (jump > mostJump_) refuseJump(to, time, jump, left(X) - X);
            break;
        }
    }
}

void Simulation::Grips::refuseJump(const Held& held, double time, double jump, const Vec3& moved) const
{
    const auto number = [](double value) { return shortNumber(value, 6); };
    throw InputError({held.grip->place,
                      "grip '" + held.grip->name + "' would jump by " + number(jump) + " m at " + number(time) + " s",
                      "at most " + shortNumber(mostJump_, 3) + " m, half a cell",
                      "what it holds has moved by [" + number(moved.x()) + ", " + number(moved.y()) + ", " +
                          number(moved.z()) + "] m by then: give it keys that pass through that"});
}

void Simulation::Grips::requireNear(std::span<const Vec3> x, double time) const
{
    for (const Held& held : held_) {
        if (std::holds_alternative<scene::Force>(held.grip->move)) continue;
        const scene::Placement place = std::visit(PlacementAt{time}, held.grip->move);
        double farthest = 0;
        Vec3 moved = Vec3::Zero();
        for (std::size_t i = 0; i < held.nodes.size(); ++i) {
            farthest = std::max(farthest, held.share[i] * (place(held.rest[i]) - x[held.nodes[i]]).norm());
            moved += (x[held.nodes[i]] - held.rest[i]) / double(held.nodes.size());
        }
        if (farthest > mostJump_) refuseJump(held, time, farthest, moved);
    }
}

bool Simulation::Grips::isDue(const Held& held, double time) const
{
    return held.grip->until && time > *held.grip->until - soon_;
}

double Simulation::Grips::endOfStep(double time, double until) const
{
    double end = until;
    for (const Held& held : held_)
        if (const auto& at = held.grip->until; at && *at > time + soon_ && *at < until - soon_)
            end = std::min(end, *at);
    return end;
}

bool Simulation::Grips::letGo(double time)
{
    bool any = false;
    for (Held& held : held_)
        if (!held.isGone && isDue(held, time)) any = held.isGone = true, held.before = {};
    return any;
}

std::vector<std::uint8_t> Simulation::Grips::heldFragments(std::size_t fragments) const
{
    std::vector<std::uint8_t> held(fragments, 0);
    for (const Held& h : held_)
        for (std::uint32_t node : h.nodes) held[boundary_.part[node]] = 1;
    return held;
}

const solver::Boundary& Simulation::Grips::boundary(double time)
{
    for (const Held& held : held_)
        for (std::uint32_t node : held.nodes) boundary_.force[node].setZero();
    for (const Held& held : held_) {
        const scene::Placement place = std::visit(PlacementAt{time}, held.grip->move);
        for (std::size_t i = 0; i < held.nodes.size(); ++i) {
            const std::uint32_t node = held.nodes[i];
            if (const auto* force = std::get_if<scene::Force>(&held.grip->move)) {
                boundary_.force[node] += held.share[i] * forceAt(*force, time);
            } else {
                boundary_.fixed[node] = 1;
                boundary_.target[node] = place(held.rest[i]);
            }
        }
    }
    return boundary_;
}

void Simulation::Grips::setStartVelocities(std::span<Vec3> v) const
{
    for (const Held& held : held_)
        for (std::size_t i = 0; i < held.nodes.size(); ++i)
            if (!std::holds_alternative<scene::Force>(held.grip->move))
                v[held.nodes[i]] = std::visit(StartVelocity{held.rest[i]}, held.grip->move);
}

std::vector<Vec3> Simulation::Grips::loads(std::span<const Vec3> reaction, double time) const
{
    std::vector<Vec3> loads;
    for (const Held& held : held_) {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < held.nodes.size(); ++i) sum += forceOn(held, i, time, reaction);
        loads.push_back(sum);
    }
    return loads;
}

/// Its force on its node i.
Vec3 Simulation::Grips::forceOn(const Held& held, std::size_t i, double time, std::span<const Vec3> reaction)
{
    const auto* force = std::get_if<scene::Force>(&held.grip->move);
    return held.share[i] * (force ? forceAt(*force, time) : reaction[held.nodes[i]]);
}

/// Work of forces that stay what they are while what they pull at moves.
double Simulation::Grips::workOf(const Wrench& wrench, const Held& held, const Move& move)
{
    if (std::holds_alternative<scene::Force>(held.grip->move)) {
        Vec3 way = Vec3::Zero();
        for (std::size_t i = 0; i < held.nodes.size(); ++i)
            way += held.share[i] * (move.x1[held.nodes[i]] - move.x0[held.nodes[i]]);
        return wrench.force.dot(way);
    }
    const auto [turn, shift] = std::visit(MotionBetween{move.t0, move.t1}, held.grip->move);
    return wrench.force.dot(shift) + ((turn - Mat3::Identity()) * wrench.moment.transpose()).trace();
}

double Simulation::Grips::workOf(const solver::HeldLeg& leg, const Held& held, const Move& move)
{
    const double time = move.t0 + leg.share * (move.t1 - move.t0);
    double work = 0;
    for (std::size_t i = 0; i < held.nodes.size(); ++i)
        work += forceOn(held, i, time, leg.reaction).dot(leg.to[held.nodes[i]] - leg.from[held.nodes[i]]);
    return work;
}

Simulation::Grips::Works Simulation::Grips::work(const Move& move, std::span<const Vec3> reaction,
                                                 std::span<const solver::HeldLeg> legs)
{
    Works works;
    for (Held& held : held_) {
        Wrench now;
        for (std::size_t i = 0; i < held.nodes.size(); ++i) {
            const Vec3 force = forceOn(held, i, move.t1, reaction);
            now.force += force;
            now.moment += force * move.x1[held.nodes[i]].transpose();
        }
        double work = 0;
        for (const solver::HeldLeg& leg : legs) work += workOf(leg, held, move);
        if (legs.empty()) {
            const double early = workOf(held.before, held, move),
                         atEnd = workOf({move.x0, move.x1, reaction, 1}, held, move);
            work = 0.5 * (early + atEnd);
            works.late += 0.5 * (atEnd - early);
        }
        works.ofGrips.emplace_back(held.grip->name, work);
        held.before = now;
    }
    return works;
}

void Simulation::Grips::save(Archive& archive) const
{
    std::vector<Vec3> wrenches;
    for (const Held& held : held_) {
        wrenches.push_back(held.before.force);
        for (Eigen::Index axis = 0; axis < 3; ++axis) wrenches.push_back(held.before.moment.col(axis));
    }
    archive.put("grips.wrench", wrenches);
}

void Simulation::Grips::restoreFrom(const Archive& archive)
{
    const auto wrenches = archive.get<Vec3>("grips.wrench", 4 * held_.size());
    for (const Vec3& v : wrenches)
        if (!v.allFinite()) archive.complain("a force of a grip is not a number");
    for (std::size_t g = 0; g < held_.size(); ++g) {
        held_[g].before.force = wrenches[4 * g];
        for (std::size_t axis = 0; axis < 3; ++axis)
            held_[g].before.moment.col(Eigen::Index(axis)) = wrenches[4 * g + 1 + axis];
    }
}

double Simulation::Grips::distance(const Body& body, const Vec3& X) const
{
    double nearest = std::numeric_limits<double>::infinity();
    for (const Held& held : held_)
        if (bodyNames_[held.body] == body.name && !held.isGone)
            nearest = std::min(nearest, signedDistance(held.grip->region, X));
    return nearest;
}

}  // namespace vdbfrac::core
