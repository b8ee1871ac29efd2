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
#include "obstacle.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/contact/touching_surface.h>
#include <vdbfrac/scene/friction.h>
#include <vdbfrac/scene/placement.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::effects {

namespace {

using contact::Penalty;
using contact::Rub;
using contact::TouchingSurface;
using contact::TouchMemory;

constexpr double kGap = 0.25;  // voxels that surfaces stay away, where there is as much room at rest
constexpr double kTold = 0.5;  // voxels in a collider at rest that a user is told of
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where all colliders are at a time.
using Places = std::vector<scene::Placement>;

/// A sample in a collider.
struct Touch {
    std::uint32_t sample = 0, collider = 0;
    double depth = 0;  ///< beyond its allowance [m]
    Vec3 outward;      ///< gradient of the distance
};

/// Where a sample is as a step begins, in the frame of a collider at t = 0, and how far from there it touches nothing.
struct Apart {
    Vec3 at;
    double room = 0;  ///< m; 0 or less: it may touch at once
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
    explicit Colliders(const scene::Scene& scene) : dx_(scene.grid.voxelSize), h_(scene.grid.coarsening * dx_)
    {
        for (const scene::Collider& c : scene.colliders) obstacles_.emplace_back(c, scene.grid);
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
        noteDepths(bodies, notes);
        law_.clear();
        for (const core::Body& body : bodies)
            for (const Obstacle& o : obstacles_)
                law_.push_back(contact::penaltyOf(o.collider().stiffness, body.material.youngsModulus(), h_));
    }

    void begin(const solver::StepStart& start) override;
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override;
    void linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const override;
    solver::EnergyFlow flow(const solver::Leg& leg) const override;
    void accept(std::span<const Vec3> x, double time, double dt) override;
    double largestStep(const solver::State& state, double time) override;
    bool cutsBack() const override { return true; }
    bool refresh(std::span<const Vec3> x) override;
    void report(Ledger& work, std::map<std::string, double>& measured) override;

    void recut(const core::Body& body, const tetmesh::CutUpdate&) override { surface_.recut(body); }
    void save(std::span<const core::Body>, core::Archive& archive) const override
    {
        surface_.save("collider", archive);
    }
    void restoreFrom(const core::Archive& archive, std::span<const core::Body>) override
    {
        surface_.restoreFrom("collider", archive);
    }
    void refineFrom(const core::Refinement& wide, std::span<const core::Body>) override
    {
        surface_.refineFrom("collider", wide);
    }
    std::size_t bytes() const override
    {
        std::size_t sum = surface_.bytes() + held_.capacity() * sizeof(Held) + apart_.capacity() * sizeof(Apart);
        for (const Obstacle& o : obstacles_) sum += o.bytes();
        return sum;
    }

private:
    Places placesAt(double time) const
    {
        Places places;
        for (const Obstacle& o : obstacles_) places.push_back(scene::placementAt(o.collider().move, time));
        return places;
    }
    double distanceAt(const Vec3& y, std::size_t collider, const Places& places) const
    {
        return obstacles_[collider].distance(places[collider].inverse(y));
    }
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
    struct Depth {
        double value = 0;  // m
        std::size_t collider = 0;
    };
    Depth deepest(std::uint32_t sample, std::span<const Vec3> x, const Places& places) const
    {
        Depth most;
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            const double depth = surface_.reach(sample) - distanceAt(surface_.at(sample, x), c, places);
            if (depth > most.value) most = {depth, c};
        }
        return most;
    }
    void noteDepths(std::span<const core::Body> bodies, std::vector<std::string>& notes);
    void see(std::span<const Vec3> x, const Places& places);
    void setOff(std::span<const Vec3> x);
    std::vector<Held> heldAt(std::span<const Vec3> x, const Places& places) const;

    double dx_, h_;  // m
    std::vector<Obstacle> obstacles_;
    std::vector<Penalty> law_;  // of each body, with each collider
    TouchingSurface surface_;

    // Of the step at hand.
    double begin_ = 0, length_ = 0;  // s
    Places start_, places_;          // when it begins; when forces are taken
    std::vector<Apart> apart_;       // of each sample, from each collider
    std::vector<Held> held_;         // by rising sample
    double deepest_ = 0;             // m
    std::size_t active_ = 0;         // samples that touched in the last step
    mutable Ledger work_;
};

/// What begins in a collider stays as deep: most often that is a mistake.
void Colliders::noteDepths(std::span<const core::Body> bodies, std::vector<std::string>& notes)
{
    surface_.settle();
    const Places places = placesAt(0);
    std::vector<double> most(bodies.size() * obstacles_.size(), 0);
    for (std::size_t i = 0; i < surface_.size(); ++i)
        for (std::size_t c = 0; c < obstacles_.size(); ++c) {
            double& depth = most[surface_.body(i) * obstacles_.size() + c];
            depth = std::max(depth, -distanceAt(surface_.restPosition(i), c, places));
        }
    for (std::size_t k = 0; k < most.size(); ++k)
        if (most[k] > kTold * dx_)
            notes.push_back("body '" + bodies[k / obstacles_.size()].name + "' begins up to " +
                            shortNumber(most[k], 3) + " m deep in collider '" +
                            obstacles_[k % obstacles_.size()].collider().name + "': it is not pushed out");
}

/// Samples that are deeper than they may be, by rising sample.
std::vector<Touch> Colliders::touches(std::span<const Vec3> x, const Places& places) const
{
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<Touch>& all) {
        for (std::uint32_t i = std::uint32_t(begin); i < end; ++i) {
            const Vec3 y = surface_.at(i, x);
            for (std::uint32_t c = 0; c < obstacles_.size(); ++c) {
                const Vec3 X = places[c].inverse(y);
                const Apart& a = apart(i, c);
                if (a.room > 0 && (X - a.at).squaredNorm() < a.room * a.room) continue;
                const double depth = surface_.reach(i) - obstacles_[c].distance(X) - surface_.memory(i).allowance;
                if (depth > 0) all.push_back({i, c, depth, places[c].turn * obstacles_[c].gradient(X)});
            }
        }
    };
    return gatherChunks<Touch>(surface_.size(), kChunk, add);
}

void Colliders::begin(const solver::StepStart& start)
{
    const StageTimer timer(work_, "collider");
    surface_.settle();
    begin_ = start.begin, length_ = start.time - start.begin;
    start_ = placesAt(begin_);
    places_ = placesAt(start.time);
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
    held_ = heldAt(x, start_);
}

/// Samples that are new may be as deep as they are.
void Colliders::see(std::span<const Vec3> x, const Places& places)
{
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::uint32_t i = std::uint32_t(begin); i < end; ++i)
            if (TouchMemory& m = surface_.memory(i); m.allowance == TouchMemory::kUnseen)
                m.see(deepest(i, x, places).value);
    });
}

/// What each sample rubs on: what pushes it most.
std::vector<Held> Colliders::heldAt(std::span<const Vec3> x, const Places& places) const
{
    std::vector<Held> all;
    for (const Touch& t : touches(x, places)) {
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
    const Places end = placesAt(begin_ + leg.length * length_);
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

void Colliders::accept(std::span<const Vec3> x, double time, double dt)
{
    const StageTimer timer(work_, "collider");
    const Places places = placesAt(time);
    std::vector<Vec3> stretch(surface_.size(), Vec3::Zero());
    std::vector<double> depth(surface_.size());
    for (const Held& h : held_) stretch[h.sample] = h.rub.kept(slipOf(h, x));
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::uint32_t i = std::uint32_t(begin); i < end; ++i) {
            const Depth most = deepest(i, x, places);
            depth[i] = most.value;
            surface_.memory(i).keep(depth[i], stretch[i], dt * obstacles_[most.collider].collider().untangleSpeed);
        }
    });
    deepest_ = 0, active_ = 0;
    for (double d : depth) deepest_ = std::max(deepest_, d), active_ += d > 0;
}

void Colliders::report(Ledger& work, std::map<std::string, double>& measured)
{
    work_.count("collider", "samples", std::int64_t(surface_.size()));
    work_.count("collider", "active", std::int64_t(active_));
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
    const Places now = placesAt(time), soon = placesAt(time + kShort);
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
                most = std::max(most, (v - carried).norm() / (room + std::max(0., distanceAt(y, c, now))));
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
