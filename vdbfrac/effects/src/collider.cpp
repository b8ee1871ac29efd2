// Colliders: solids that push bodies out, and rub against them.
//
//   U(x) = sum over samples s and colliders c of A_s psi(-g - a_s),  g = d_c(T_c^-1 y_s) - r_s
//   y_s  a point of the surface; A_s its area at rest, r_s its reach
//   d_c  signed distance of a collider where it was at t = 0, T_c where it is when the forces are taken
//   a_s  allowance: how deep a sample already was when it was first seen. What is born tangled is not thrown out, but
//        goes no deeper; it only falls, by untangle_speed too.
// Points on stretched edges of the surface touch too, with its area as it is stretched: between samples that are drawn
// apart something narrow would pass. They have the friction of the ends of their edges.
// Friction is that of contact/contact_law.h, against the motion of the collider; normal forces and directions are
// brought up to date where a step is solved.
#include "all.h"
#include "collider_contacts.h"
#include "collider_drawing.h"
#include "collider_obstacles.h"
#include "collider_search.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/contact/edged_surface.h>
#include <vdbfrac/scene/friction.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdbfrac::effects {

namespace {

using contact::Penalty;
using contact::SampleMemory;

constexpr double kGap = 0.25;  // voxels that surfaces stay away, where there is as much room at rest
constexpr double kNever = -1;  // s

class Colliders : public core::Effect,
                  public solver::Potential,
                  public core::StepLimit,
                  public core::Reporter,
                  public core::RecutStage,
                  public core::DrawStage,
                  public core::Persistent {
public:
    explicit Colliders(const scene::Scene& scene)
        : dx_(scene.grid.voxelSize),
          h_(scene.grid.coarsening * dx_),
          frame_(1 / scene.time.fps),
          isMovedOut_(scene.output.movedOut),
          obstacles_(scene)
    {
    }

    std::string name() const override { return "collider"; }
    void join(core::Stages& stages) override
    {
        stages.solve.push_back(this);
        stages.limits.push_back(this);
        stages.reporters.push_back(this);
        stages.recut.push_back(this);
        if (isMovedOut_) stages.draw.push_back(this);
        stages.persistent.push_back(this);
    }
    void start(const core::SolvedStep& now, std::span<const core::Body> bodies,
               std::vector<std::string>& notes) override
    {
        surface_.start(bodies, kGap * dx_);
        surface_.settle();
        noteDepths(surface_, now, bodies, obstacles_, notes), noteSizes(obstacles_, dx_, notes);
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
    bool isAdmissible(const solver::WholeStep& way) const override;
    void accept(std::span<const Vec3> x, double time, double dt) override;
    double largestStep(const solver::State& state, double time) override;
    bool cutsBack() const override { return true; }
    bool refresh(std::span<const Vec3> x) override;
    void report(Ledger& work, std::map<std::string, double>& measured) override;

    void recut(const core::Body& body, const tetmesh::CutUpdate&) override { surface_.recut(body); }
    void place(double time, std::span<core::DrawnSurface> surfaces) const override
    {
        for (core::DrawnSurface& surface : surfaces) moveOut(obstacles_, time, dx_, surface);
    }
    void save(std::span<const core::Body>, core::Archive& archive) const override
    {
        surface_.save("collider", archive);
        archive.putOne("collider.changed", std::int64_t{isChanged_});
    }
    void restoreFrom(const core::Archive& archive, std::span<const core::Body>) override
    {
        surface_.restoreFrom("collider", archive);
        isChanged_ = archive.getOne<std::int64_t>("collider.changed") != 0;
    }
    void branchFrom(const core::Archive& archive, std::span<const core::Body> bodies) override
    {
        restoreFrom(archive, bodies), isChanged_ = true;
    }
    void refineFrom(const core::Refinement& wide, std::span<const core::Body>) override
    {
        surface_.refineFrom("collider", wide), isChanged_ = true;
    }
    std::size_t bytes() const override
    {
        return surface_.bytes() + friction_.capacity() * sizeof(ColliderFriction) +
               (begun_.capacity() + from_.capacity()) * sizeof(Vec3) + obstacles_.bytes();
    }

private:
    std::vector<ColliderContact> contactsAt(std::span<const Vec3> x, const Places& places) const
    {
        std::int64_t pairs = 0;
        std::vector<ColliderContact> all = search_.contacts(x, places, pairs);
        work_.count("collider", "pairs", pairs);
        return all;
    }
    /// Of a touch or a push.
    const Penalty& lawOf(const auto& t) const { return law_[surface_.body(t.sample) * obstacles_.size() + t.collider]; }
    double energyOf(const ColliderContact& t) const { return surface_.area(t.sample) * lawOf(t).energy(t.depth); }
    Vec3 forceOf(const ColliderContact& t) const
    {
        return surface_.area(t.sample) * lawOf(t).pressure(t.depth) * t.outward;
    }
    /// Since the step began, against colliders at their places.
    Vec3 slipOf(const ColliderFriction& h, std::span<const Vec3> x, const Places& places) const
    {
        return h.spring.slip(surface_.at(h.sample, x) - places[h.collider](h.anchor));
    }
    void see(std::span<const Vec3> x, bool all);
    void look(std::span<const Vec3> x, std::span<const Vec3> v, double time);
    bool lookLate(std::span<const Vec3> x, double time);
    std::vector<ColliderPush> pushesAt(std::span<const Vec3> x, const Places& places) const;
    std::vector<ColliderFriction> frictionAt(std::span<const Vec3> x, const Places& places) const;

    double dx_, h_;             // m
    double frame_;              // s: no step is longer
    double outside_ = 2 * dx_;  // m: samples on sharp edges lie up to a voxel off the cut, and reach out
    bool isMovedOut_;           // in what is drawn
    Obstacles obstacles_;
    std::vector<Penalty> law_;  // of each body, with each collider
    contact::EdgedSurface surface_;
    ColliderSearch search_{surface_, obstacles_};
    double lookedAt_ = kNever;          // s
    mutable bool hasComeNear_ = false;  // what was far has, in the step at hand
    bool isChanged_ = false;            // colliders are others than in the last step

    // Of the step at hand.
    double begin_ = 0, length_ = 0, fromTime_ = 0;  // s; of from_
    Places start_, places_;                         // when it begins; when forces are taken
    Places begunPlaces_;                            // as it began, in whichever stage it is
    std::vector<Vec3> begun_;                       // of each sample [m]: as it began
    std::vector<Vec3> from_;                        // of each node [m]: as it began, far from all; none near
    std::vector<ColliderFriction> friction_;        // by rising sample
    double deepest_ = 0;                            // m
    std::size_t active_ = 0;                        // samples that touched in the last step
    std::vector<Vec3> loads_;                       // N: of each collider, on the material
    mutable Ledger work_;
};

void Colliders::begin(const solver::StepStart& start)
{
    const StageTimer timer(work_, "collider");
    begin_ = start.begin, length_ = start.time - start.begin;
    look(start.x, start.v, begin_);
    places_ = obstacles_.placesAt(start.time), friction_ = frictionAt(start.x, start_);
}

/// Where everything is as a step begins, or a stage of one; once, unless a step has been kept since. Where nothing is
/// expected to come near within a frame there are no samples: a body that tears far from all colliders makes none.
void Colliders::look(std::span<const Vec3> x, std::span<const Vec3> v, double time)
{
    if (hasComeNear_) lookedAt_ = kNever;
    if (lookedAt_ == time) return;
    const bool isFirst = std::exchange(lookedAt_, time) == kNever;  // since a step was kept
    start_ = obstacles_.placesAt(time);
    if (isFirst) {
        if (std::exchange(hasComeNear_, false) || search_.mayTouch({x, v, time, frame_, outside_}, start_))
            surface_.settle(), from_.clear();
        else
            surface_.leave(), from_.assign(x.begin(), x.end()), fromTime_ = time;
        surface_.placeOnEdges(x);
        begunPlaces_ = start_, begun_.resize(surface_.size());
        parallelChunks(begun_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) begun_[i] = surface_.at(i, x);
        });
    }
    see(x, isFirst && isChanged_);
    const std::vector<double> room = search_.room(x, start_);
    surface_.chooseOnEdges(x, dx_, [&](std::uint32_t a, std::uint32_t b, double length) {
        return std::min(room[a], room[b]) < length + dx_;
    });
}

/// Where a step has come near what it was far from as it began: its samples, as they were there. Has it?
bool Colliders::lookLate(std::span<const Vec3> x, double time)
{
    if (from_.empty() || !search_.mayHaveTouched({from_, x, fromTime_, time}, outside_)) return false;
    hasComeNear_ = true, look(std::exchange(from_, {}), {}, fromTime_);
    return start_ = obstacles_.placesAt(lookedAt_ = begin_), true;
}

/// Samples may be as deep as they are where they are new; `all`: and where colliders are others than they were.
void Colliders::see(std::span<const Vec3> x, bool all)
{
    parallelChunks(surface_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            SampleMemory& memory = surface_.memory(i);
            if (!all && memory.allowance != SampleMemory::kUnseen) continue;
            double depth = 0;
            for (std::size_t c = 0; c < obstacles_.size(); ++c)
                depth = std::max(depth, surface_.reach(i) - obstacles_.distance(surface_.at(i, x), c, start_));
            memory.see(depth);
        }
    });
}

/// What pushes samples, by rising sample and collider: what pushes a point of an edge pushes its ends.
std::vector<ColliderPush> Colliders::pushesAt(std::span<const Vec3> x, const Places& places) const
{
    std::vector<ColliderPush> all;
    for (const ColliderContact& t : contactsAt(x, places))
        surface_.visitSamples(t.sample, [&](std::size_t sample, double share) {
            all.push_back({std::uint32_t(sample), t.collider, share * forceOf(t)});
        });
    return merged(std::move(all));
}

/// What each sample rubs on: what pushes it most.
std::vector<ColliderFriction> Colliders::frictionAt(std::span<const Vec3> x, const Places& places) const
{
    std::vector<ColliderFriction> all;
    for (const ColliderPush& p : pushesAt(x, places)) {
        const double push = p.force.norm(), friction = obstacles_[p.collider].collider().friction,
                     k = surface_.area(p.sample) * lawOf(p).k();
        if (!(friction * push > 0) || !(k > 0)) continue;  // ends of edges between sharp triangles have no area
        const contact::FrictionSpring spring =
            contact::makeFrictionSpring(p.force / push, friction * push, k, surface_.memory(p.sample).stretch);
        const Vec3 anchor = begunPlaces_[p.collider].inverse(begun_[p.sample]);
        contact::addStrongest(ColliderFriction{p.sample, p.collider, anchor, spring}, all);
    }
    return all;
}

bool Colliders::refresh(std::span<const Vec3> x)
{
    const StageTimer timer(work_, "collider");
    if (lookLate(x, begin_ + length_)) return true;
    std::vector<ColliderFriction> held = frictionAt(x, places_);
    const bool slips = contact::haveChanged<ColliderFriction>(
        friction_, held, [](const ColliderFriction& h) { return h.spring.push(); });
    if (slips) friction_ = std::move(held);
    return slips;
}

double Colliders::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const
{
    const StageTimer timer(work_, "collider");
    double energy = 0;
    for (const ColliderContact& t : contactsAt(x, places_)) {
        energy += energyOf(t);
        surface_.addForce(t.sample, forceOf(t), gradient);
    }
    for (const ColliderFriction& h : friction_) {
        const Vec3 slip = slipOf(h, x, places_);
        energy += h.spring.energy(slip);
        surface_.addForce(h.sample, h.spring.force(slip), gradient);
    }
    return energy;
}

void Colliders::linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const
{
    if (begun_.empty()) return;  // before the first step nobody has looked
    const StageTimer timer(work_, "collider");
    const auto add = [&](std::uint32_t sample, const Mat3& Q) {
        solver::Coupling c;
        surface_.couple(sample, c);
        c.Q = contact::blockOf(Q);
        couplings.push_back(c);
    };
    for (const ColliderContact& t : contactsAt(x, places_))
        add(t.sample, surface_.area(t.sample) * lawOf(t).stiffness(t.depth) * t.outward * t.outward.transpose());
    for (const ColliderFriction& h : friction_) {
        const Vec3 slip = slipOf(h, x, places_);
        h.spring.follow(slip, h.dual);
        add(h.sample, h.spring.stiffness(slip, h.dual));
    }
}

/// Contact holds energy, and colliders that move bring some; friction takes it, but for what stretches slip.
solver::EnergyFlow Colliders::flow(const solver::Leg& leg) const
{
    const Places end = obstacles_.placesAt(begin_ + leg.length * length_);
    const StageTimer timer(work_, "collider");
    double before = 0, after = 0, along = 0, brought = 0, stretched = 0, rubbed = 0;
    const auto from = [&](const auto& t) { return surface_.at(t.sample, leg.from); };
    const auto to = [&](const auto& t) { return surface_.at(t.sample, leg.to); };
    // What a push brings in on the way of its collider: the mean of both ends, as forces change with depth.
    for (const ColliderContact& t : contactsAt(leg.from, start_)) {
        before += energyOf(t);
        brought += .5 * forceOf(t).dot(obstacles_.carry(from(t), t.collider, start_, end) - from(t));
    }
    for (const ColliderContact& t : contactsAt(leg.to, end)) {
        after += energyOf(t);
        brought += .5 * forceOf(t).dot(to(t) - obstacles_.carry(to(t), t.collider, end, start_));
    }
    for (const ColliderContact& t : contactsAt(leg.at, places_)) along += forceOf(t).dot(to(t) - from(t));
    for (const ColliderFriction& h : friction_) {
        const Vec3 force = h.spring.force(slipOf(h, leg.at, places_)), way = to(h) - from(h),
                   carried = obstacles_.carry(from(h), h.collider, start_, end) - from(h);
        along += force.dot(way), brought += force.dot(carried);
        const Vec3 before = leg.isFirst ? h.spring.stretch : h.spring.kept(slipOf(h, leg.from, start_));
        stretched += force.dot(h.spring.kept(slipOf(h, leg.to, end)) - before);
        rubbed -= force.dot(way - carried);
    }
    const double work = before - after + brought + stretched, dissipated = rubbed + stretched;
    return {work, dissipated, work - dissipated - along};
}

/// A step may take a sample farther than its speed told, and so to the other side of a thin collider.
bool Colliders::isAdmissible(const solver::WholeStep& way) const
{
    const StageTimer timer(work_, "collider");
    hasComeNear_ = !from_.empty() && search_.mayHaveTouched(way, outside_);  // schemes that never refresh
    return !hasComeNear_ && !search_.isAnyPassed(way);
}

void Colliders::accept(std::span<const Vec3> x, double time, double dt)
{
    const StageTimer timer(work_, "collider");
    (void)lookLate(x, time);  // a step that is kept unsolved: nobody has asked yet
    lookedAt_ = kNever, isChanged_ = hasComeNear_ = false;
    const Places places = obstacles_.placesAt(time);
    std::vector<Vec3> stretch(surface_.size(), Vec3::Zero());
    loads_.assign(obstacles_.size(), Vec3::Zero());
    for (const ColliderContact& t : contactsAt(x, places)) loads_[t.collider] += forceOf(t);
    for (const ColliderFriction& h : friction_) {
        const Vec3 slip = slipOf(h, x, places);
        stretch[h.sample] = h.spring.kept(slip), loads_[h.collider] += h.spring.force(slip);
    }
    const std::vector<ColliderSearch::Depth> depths = search_.depths(x, places);
    deepest_ = 0, active_ = 0;
    for (std::size_t i = 0; i < depths.size(); ++i) {
        const auto& [depth, collider] = depths[i];
        deepest_ = std::max(deepest_, depth);
        if (surface_.isOnEdge(i)) continue;
        active_ += depth > 0;
        surface_.memory(i).keep(depth, stretch[i], dt * obstacles_[collider].collider().untangleSpeed);
    }
    surface_.forgetStrained();
}

void Colliders::report(Ledger& work, std::map<std::string, double>& measured)
{
    work_.count("collider", "samples", std::int64_t(surface_.size()));
    work_.count("collider", "active", std::int64_t(active_));
    work_.count("collider", "edge_points", std::int64_t(surface_.points() - surface_.size()));
    measured["collider_depth_m"] = deepest_;
    for (std::size_t c = 0; c < loads_.size(); ++c)
        for (int axis = 0; axis < 3; ++axis)
            measured["collider_load_" + obstacles_[c].collider().name + "_" + "xyz"[axis] + "_N"] = loads_[c][axis];
    work.add(work_), work_.clear();
}

/// No sample passes more than half a collider in a step, so none comes out on the other side.
double Colliders::largestStep(const solver::State& state, double time)
{
    const StageTimer timer(work_, "collider");
    look(state.x, state.v, time);
    places_ = start_, friction_ = frictionAt(state.x, start_);
    const double rate = search_.fastest(state, start_, time);
    return rate > 0 ? 1 / rate : kInfinity;
}

std::unique_ptr<core::Effect> make(const scene::Values&, const scene::Scene& scene)
{
    for (const scene::Collider& c : scene.colliders) scene::requireFrictionFits(scene, c.place, c.friction);
    return std::make_unique<Colliders>(scene);
}

}  // namespace

EffectInfo collider()
{
    return {.table = {"collider", "", {}},
            .stages = "solve, limit on the time step, what frames draw",
            .make = make,
            .inScene = [](const scene::Scene& scene) { return !scene.colliders.empty(); }};
}

}  // namespace vdbfrac::effects
