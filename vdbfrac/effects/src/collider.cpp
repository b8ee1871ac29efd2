// Colliders: solids that push bodies out, and rub against them.
//
//   U(x) = sum over samples s and colliders c of A_s psi(-g - a_s),  g = d_c(T_c^-1 y_s) - r_s
//   y_s  a point of the surface; A_s its area at rest, r_s its reach
//   d_c  signed distance of a collider where it was at t = 0, T_c where it is when the forces are taken
//   a_s  allowance: how deep a sample already was when it was first seen. What is born tangled is not thrown out, but
//        goes no deeper; it only falls, by untangle_speed too.
// Friction is that of contact/contact_law.h, against the motion of the collider; normal forces and directions are
// brought up to date where a step is solved.
#include "all.h"
#include "obstacles.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/contact/edged_surface.h>
#include <vdbfrac/scene/friction.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::effects {

namespace {

using contact::Penalty;
using contact::Rub;
using contact::TouchMemory;

constexpr double kGap = 0.25;  // voxels that surfaces stay away, where there is as much room at rest
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A sample in a collider, or a point of a stretched edge.
struct Touch {
    std::uint32_t sample = 0, collider = 0;
    double depth = 0;  ///< beyond its allowance [m]
    Vec3 outward;      ///< gradient of the distance
};

/// The strongest touch of a sample.
struct Held {
    std::uint32_t sample = 0, collider = 0;
    Rub rub;
    Vec3 carried;  ///< m: where the collider has taken the sample's place since
    mutable contact::Dual dual = rub.dual();
};

class Colliders : public core::Effect,
                  public solver::Potential,
                  public core::StepLimit,
                  public core::Reporter,
                  public core::RecutStage,
                  public core::Persistent {
public:
    explicit Colliders(const scene::Scene& scene)
        : dx_(scene.grid.voxelSize), h_(scene.grid.coarsening * dx_), obstacles_(scene)
    {
    }

    std::string name() const override { return "collider"; }
    void join(core::Stages& stages) override
    {
        stages.solve.push_back(this);
        stages.limits.push_back(this);
        stages.reporters.push_back(this);
        stages.recut.push_back(this);
        stages.persistent.push_back(this);
    }
    void start(std::span<const core::Body> bodies, std::vector<std::string>& notes) override
    {
        surface_.start(bodies, kGap * dx_);
        surface_.settle();
        noteDepths(surface_, bodies, obstacles_, notes);
        law_.clear();
        for (const core::Body& body : bodies)
            for (std::size_t c = 0; c < obstacles_.size(); ++c)
                law_.push_back(
                    contact::penaltyOf(obstacles_[c].collider().stiffness, body.material.youngsModulus(), h_));
    }

    void begin(const solver::StepStart& start) override;
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override;
    void linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const override;
    solver::EnergyFlow flow(const solver::Leg& leg) const override;
    bool holds(std::span<const Vec3> x) const override;
    void accept(std::span<const Vec3> x, double time, double dt) override;
    double largestStep(const solver::State& state, double time) override;
    bool cutsBack() const override { return true; }
    bool refresh(std::span<const Vec3> x) override;
    void report(Ledger& work, std::map<std::string, double>& measured) override;

    void recut(const core::Body& body, const tetmesh::CutUpdate&) override { surface_.recut(body); }
    void save(std::span<const core::Body>, core::Archive& archive) const override
    {
        surface_.save("collider", archive);
        archive.putOne<std::int64_t>("collider.other", isOther_);
    }
    void restoreFrom(const core::Archive& archive, std::span<const core::Body>) override
    {
        surface_.restoreFrom("collider", archive);
        isOther_ = archive.getOne<std::int64_t>("collider.other") != 0;
    }
    void branchFrom(const core::Archive& archive, std::span<const core::Body> bodies) override
    {
        restoreFrom(archive, bodies), isOther_ = true;
    }
    void refineFrom(const core::Refinement& wide, std::span<const core::Body>) override
    {
        surface_.refineFrom("collider", wide), isOther_ = true;
    }
    std::size_t bytes() const override
    {
        return surface_.bytes() + held_.capacity() * sizeof(Held) + apart_.capacity() * sizeof(Apart) +
               obstacles_.bytes();
    }

private:
    const Apart& apart(std::size_t sample, std::size_t collider) const
    {
        return apart_[sample * obstacles_.size() + collider];
    }
    std::vector<Touch> touches(std::span<const Vec3> x, const Places& places) const;
    const Penalty& lawOf(const Touch& t) const
    {
        return law_[surface_.body(t.sample) * obstacles_.size() + t.collider];
    }
    double energyOf(const Touch& t) const { return surface_.area(t.sample) * lawOf(t).energy(t.depth); }
    Vec3 forceOf(const Touch& t) const { return surface_.area(t.sample) * lawOf(t).pressure(t.depth) * t.outward; }
    Vec3 slipOf(const Held& h, std::span<const Vec3> x) const
    {
        return h.rub.slip(surface_.at(h.sample, x) - h.carried);
    }
    Obstacles::Nearest nearest(std::size_t point, std::span<const Vec3> x, const Places& places) const
    {
        return obstacles_.nearest(surface_.at(point, x), places);
    }
    double depthOf(std::size_t point, const Obstacles::Nearest& nearest) const
    {
        return std::max(0., surface_.reach(point) - nearest.distance);
    }
    void see(std::span<const Vec3> x, const Places& places);
    void setOff(std::span<const Vec3> x);
    std::vector<Held> heldAt(std::span<const Vec3> x, const Places& places) const;

    double dx_, h_;  // m
    Obstacles obstacles_;
    std::vector<Penalty> law_;  // of each body, with each collider
    contact::EdgedSurface surface_;

    bool isOther_ = false;  // colliders may not be those that samples have touched

    // Of the step at hand.
    double begin_ = 0, length_ = 0;  // s
    Places start_, places_;          // when it begins; when forces are taken
    std::vector<Apart> apart_;       // of each sample, from each collider
    std::vector<Held> held_;         // by rising sample
    double deepest_ = 0;             // m
    std::size_t active_ = 0;         // samples that touched in the last step
    mutable Ledger work_;
};

/// Samples that are deeper than they may be, by rising sample.
std::vector<Touch> Colliders::touches(std::span<const Vec3> x, const Places& places) const
{
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<Touch>& all) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 y = surface_.at(i, x);
            for (std::uint32_t c = 0; c < obstacles_.size(); ++c) {
                const Vec3 X = places[c].inverse(y);
                if (!surface_.isOnEdge(i) && apart(i, c).isSafe(X)) continue;
                const double depth = surface_.reach(i) - obstacles_[c].distance(X) - surface_.allowance(i);
                if (depth > 0) all.push_back({std::uint32_t(i), c, depth, places[c].turn * obstacles_[c].gradient(X)});
            }
        }
    };
    return gatherChunks<Touch>(surface_.points(), kChunk, add);
}

void Colliders::begin(const solver::StepStart& start)
{
    const StageTimer timer(work_, "collider");
    surface_.settle();
    begin_ = start.begin, length_ = start.time - start.begin;
    start_ = obstacles_.placesAt(begin_);
    places_ = obstacles_.placesAt(start.time);
    setOff(start.x);
}

void Colliders::setOff(std::span<const Vec3> x)
{
    see(x, start_);
    const std::size_t colliders = obstacles_.size();
    apart_.resize(surface_.size() * colliders);
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (std::size_t c = 0; c < colliders; ++c) {
                const Vec3 X = start_[c].inverse(surface_.at(i, x));
                const double gap = obstacles_[c].distance(X) - surface_.reach(i);
                apart_[i * colliders + c] = {X, gap / obstacles_[c].steepest()};
            }
    });
    surface_.chooseOnEdges(x, dx_, [&](std::uint32_t a, std::uint32_t b, double length, const Vec3& y) {
        bool isNear = false;
        for (std::size_t c = 0; c < colliders; ++c) {
            if (std::min(apart(a, c).room, apart(b, c).room) > length + dx_) continue;
            isNear = true;
            if (obstacles_[c].hasPassed(start_[c].inverse(y), apart(a, c).at, apart(b, c).at)) return false;
        }
        return isNear;
    });
    held_ = heldAt(x, start_);
}

/// Samples that are new may be as deep as they are; and deeper than they were, by as much, where colliders are others.
void Colliders::see(std::span<const Vec3> x, const Places& places)
{
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            TouchMemory& m = surface_.memory(i);
            if (isOther_) m.before = m.depth;
            if (isOther_ || m.allowance == TouchMemory::kUnseen) m.see(depthOf(i, nearest(i, x, places)));
        }
    });
    isOther_ = false;
}

/// What each sample rubs on: what pushes it most.
std::vector<Held> Colliders::heldAt(std::span<const Vec3> x, const Places& places) const
{
    std::vector<Held> all;
    for (const Touch& t : touches(x, places)) {
        if (surface_.isOnEdge(t.sample)) break;  // smooth, and after all samples
        const double push = forceOf(t).norm(), friction = obstacles_[t.collider].collider().friction;
        if (!(friction * push > 0)) continue;
        const Rub rub = contact::makeRub(t.outward.normalized(), friction * push,
                                         surface_.area(t.sample) * lawOf(t).k(), surface_.memory(t.sample).stretch);
        const Vec3 carried = places_[t.collider](apart(t.sample, t.collider).at);
        contact::addStrongest(Held{t.sample, t.collider, rub, carried}, all);
    }
    return all;
}

bool Colliders::refresh(std::span<const Vec3> x)
{
    const StageTimer timer(work_, "collider");
    std::vector<Held> held = heldAt(x, places_);
    const bool rubs = contact::haveChanged<Held>(held_, held, [](const Held& h) { return h.rub.push(); });
    if (rubs) held_ = std::move(held);
    return rubs;
}

double Colliders::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const
{
    const StageTimer timer(work_, "collider");
    double energy = 0;
    for (const Touch& t : touches(x, places_)) {
        energy += energyOf(t);
        surface_.addForce(t.sample, forceOf(t), gradient);
    }
    for (const Held& h : held_) {
        const Vec3 slip = slipOf(h, x);
        energy += h.rub.energy(slip);
        surface_.addForce(h.sample, h.rub.force(slip), gradient);
    }
    return energy;
}

void Colliders::linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const
{
    const StageTimer timer(work_, "collider");
    const auto add = [&](std::uint32_t sample, const Mat3& Q) {
        solver::Coupling c;
        surface_.couple(sample, c);
        c.Q = contact::blockOf(Q);
        couplings.push_back(c);
    };
    for (const Touch& t : touches(x, places_))
        add(t.sample, surface_.area(t.sample) * lawOf(t).stiffness(t.depth) * t.outward * t.outward.transpose());
    for (const Held& h : held_) {
        const Vec3 slip = slipOf(h, x);
        h.rub.follow(slip, h.dual);
        add(h.sample, h.rub.stiffness(slip, h.dual));
    }
}

/// Contact holds energy, and colliders that move bring some; friction takes it, but for what stretches slip.
solver::EnergyFlow Colliders::flow(const solver::Leg& leg) const
{
    const Places end = obstacles_.placesAt(begin_ + leg.length * length_);
    const StageTimer timer(work_, "collider");
    double before = 0, after = 0, along = 0, brought = 0, stretched = 0, rubbed = 0;
    for (const Touch& t : touches(leg.from, start_)) before += energyOf(t);
    for (const Touch& t : touches(leg.to, end)) after += energyOf(t);
    const auto push = [&](std::uint32_t sample, std::uint32_t collider, const Vec3& force) {
        const Vec3 y0 = surface_.at(sample, leg.from), way = surface_.at(sample, leg.to) - y0,
                   carried = end[collider](start_[collider].inverse(y0)) - y0;
        along += force.dot(way);
        brought += force.dot(carried);
        return Vec3(way - carried);
    };
    for (const Touch& t : touches(leg.at, places_)) push(t.sample, t.collider, forceOf(t));
    for (const Held& h : held_) {
        const Vec3 slip = slipOf(h, leg.at), force = h.rub.force(slip), way = push(h.sample, h.collider, force);
        stretched += force.dot(h.rub.kept(slip) - h.rub.stretch);
        rubbed -= force.dot(way);
    }
    const double work = before - after + brought + stretched, dissipated = rubbed + stretched;
    return {work, dissipated, work - dissipated - along};
}

/// A step may take a sample farther than its speed told, and through a thin collider: out where it was not in.
bool Colliders::holds(std::span<const Vec3> x) const
{
    const StageTimer timer(work_, "collider");
    const auto hasPassed = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (std::size_t c = 0; c < obstacles_.size(); ++c) {
                const Apart& a = apart(i, c);
                const Vec3 X = places_[c].inverse(surface_.at(i, x)), way = X - a.at;
                const double room = std::max(0., a.room) + obstacles_[c].halfThickness();
                if (way.squaredNorm() < room * room) continue;
                if (obstacles_[c].distance(a.at + .5 * way) < 0) return 1.;
            }
        return 0.;
    };
    return orderedMax(surface_.size(), kChunk, 0, hasPassed) == 0;
}

void Colliders::accept(std::span<const Vec3> x, double time, double dt)
{
    const StageTimer timer(work_, "collider");
    const Places places = obstacles_.placesAt(time);
    std::vector<Vec3> stretch(surface_.size(), Vec3::Zero());
    std::vector<double> depth(surface_.size());
    for (const Held& h : held_) stretch[h.sample] = h.rub.kept(slipOf(h, x));
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::uint32_t i = std::uint32_t(begin); i < end; ++i) {
            const Obstacles::Nearest to = nearest(i, x, places);
            depth[i] = depthOf(i, to);
            surface_.memory(i).keep(depth[i], stretch[i], dt * obstacles_[to.collider].collider().untangleSpeed);
        }
    });
    deepest_ = 0, active_ = 0;
    for (double d : depth) deepest_ = std::max(deepest_, d), active_ += d > 0;
    for (std::size_t i = surface_.size(); i < surface_.points(); ++i)
        deepest_ = std::max(deepest_, depthOf(i, nearest(i, x, places)));
}

void Colliders::report(Ledger& work, std::map<std::string, double>& measured)
{
    work_.count("collider", "samples", std::int64_t(surface_.size()));
    work_.count("collider", "active", std::int64_t(active_));
    work_.count("collider", "edge_points", std::int64_t(surface_.points() - surface_.size()));
    measured["collider_depth_m"] = deepest_;
    work.add(work_);
    work_.clear();
}

/// No sample passes more than half a collider in a step, so none comes out on the other side.
double Colliders::largestStep(const solver::State& state, double time)
{
    constexpr double kShort = 1e-6;  // s: in which a collider's speed is measured
    const StageTimer timer(work_, "collider");
    surface_.settle();
    const Places now = obstacles_.placesAt(time), soon = obstacles_.placesAt(time + kShort);
    start_ = places_ = now;
    setOff(state.x);
    const double rate = orderedMax(surface_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::uint32_t i = std::uint32_t(begin); i < end; ++i) {
            const Vec3 y = surface_.at(i, state.x), v = surface_.at(i, state.v);
            for (std::size_t c = 0; c < obstacles_.size(); ++c) {
                const double room = obstacles_[c].halfThickness();
                if (!std::isfinite(room)) continue;
                const Vec3 carried = (soon[c](now[c].inverse(y)) - y) / kShort;
                most = std::max(most, (v - carried).norm() / (room + std::max(0., obstacles_.distance(y, c, now))));
            }
        }
        return most;
    });
    return rate > 0 ? 1 / rate : kInfinity;
}

std::unique_ptr<core::Effect> make(const scene::Values&, const scene::Scene& scene)
{
    for (const scene::Collider& c : scene.colliders) scene::requireFrictionFits(scene, c.place, c.friction);
    return std::make_unique<Colliders>(scene);
}

bool inScene(const scene::Scene& scene) { return !scene.colliders.empty(); }

}  // namespace

EffectInfo collider()
{
    return {.table = {"collider", "", {}}, .stages = "solve, limit on the time step", .make = make, .inScene = inScene};
}

}  // namespace vdbfrac::effects
