// Contact of bodies and their fragments with each other, and of each with itself.
//
//   U(x) = sum over samples s of 1/2 A_s psi(-g_s - a_s),  g_s = sum_a b_a phi_a - r_s
//   b    barycentric coordinates, in a tet T, of a point y_s of the surface; phi_a: phi at the corners of T, as the cut
//        of its own piece of material sees it; half, as both sides sample each other
//   r_s  reach of the sample
//   a_s  allowance: how deep a sample already was when it was first seen. What is born tangled is not thrown out, but
//        goes no deeper: it grows only where material is cut again, and where cells fold (allowJumps).
// Because y = sum_a b_a z_a in T, forces and their moments on both sides cancel exactly. Fisher, Lin 2001 (distance
// carried along by tets); Gast et al. 2015, section 6 (as a penalty in the minimisation of backward Euler).
// Friction is that of contact/contact_law.h.
// The gradient of g jumps from tet to tet. So within a solve each sample keeps its tet, in which g is linear all over
// space; where the solution lies in others, those are taken and it is solved on. Normal forces of friction are brought
// up to date with them.
#include "all.h"
#include "contact_drawing.h"
#include "contact_points.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/contact/contact_law.h>
#include <vdbfrac/contact/contact_surface.h>
#include <vdbfrac/contact/contact_search.h>
#include <vdbfrac/contact/trembling.h>
#include <vdbfrac/scene/friction.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::effects {

namespace {

using contact::InTarget;
using contact::Pair;
using contact::Penetration;
using contact::SampleMemory;

class Contact : public core::Effect,
                public solver::Potential,
                public core::StepLimit,
                public core::Reporter,
                public core::RecutStage,
                public core::DrawStage,
                public core::Persistent {
public:
    Contact(const scene::Values& values, const scene::Scene& scene)
        : mu_(values.number("friction")),
          gap_(values.number("gap")),
          untangleSpeed_(values.number("untangle_speed")),
          closesLips_(values.text("lips") == "closed"),
          drawsApart_(values.text("drawn") == "apart"),
          dx_(scene.grid.voxelSize),
          h_(scene.grid.coarsening * dx_),
          longest_(1 / (scene.time.fps * std::max(1, scene.time.substeps))),
          forces_(surface_, targets_, values.number("stiffness"), h_),
          search_(h_)
    {
    }

    std::string name() const override { return "contact"; }
    void join(core::Stages& stages) override
    {
        stages.solve.push_back(this);
        stages.limits.push_back(this);
        stages.reporters.push_back(this);
        stages.recut.push_back(this);
        // Colliders have the last word.
        if (drawsApart_) stages.draw.insert(stages.draw.begin(), this);
        stages.persistent.push_back(this);
    }
    void start(const core::SolvedStep& now, std::span<const core::Body> bodies, std::vector<std::string>&) override
    {
        bodies_ = bodies;
        forces_.start(bodies);
        surface_.start(bodies, gap_ * dx_, closesLips_);
        if (now.time == 0) surface_.bury(kDepth * dx_);  // which goes by places at rest
    }

    void begin(const solver::StepStart& start) override;
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override;
    void linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const override;
    solver::EnergyFlow flow(const solver::Leg& leg) const override;
    void prune(std::span<const Vec3> x) override;
    bool refresh(std::span<const Vec3> x) override;
    bool isAdmissible(const solver::WholeStep& way) const override;
    void accept(std::span<const Vec3> x, double time, double dt) override;
    double largestStep(const solver::State& state, double time) override;
    bool cutsBack() const override { return true; }
    void report(Ledger& work, std::map<std::string, double>& measured) override;

    void recut(const core::Body& body, const tetmesh::CutUpdate&) override
    {
        surface_.recut(body), forget();
        isChanged_ |= closesLips_;
    }
    void place(double, std::span<core::DrawnSurface> surfaces) const override { drawApart(surfaces, dx_); }
    void save(std::span<const core::Body>, core::Archive& archive) const override
    {
        surface_.save("contact", archive), search_.save("contact", archive), trembling_.save("contact", archive);
        archive.putOne("contact.step", last_);
        archive.putOne("contact.changed", std::int64_t{isChanged_});
    }
    void restoreFrom(const core::Archive& archive, std::span<const core::Body>) override { restore(archive, true); }
    void branchFrom(const core::Archive& archive, std::span<const core::Body>) override
    {
        restore(archive, false), search_.clear(), isChanged_ = true;
    }
    void refineFrom(const core::Refinement& wide, std::span<const core::Body>) override
    {
        surface_.refineFrom("contact", wide), restoreStep(wide.archive);
    }
    std::size_t bytes() const override
    {
        return surface_.bytes() + targets_.bytes() + search_.bytes() + trembling_.bytes() + inSolve_.bytes();
    }

private:
    /// `keepsReaches`: the settings are those of the run.
    void restore(const core::Archive& archive, bool keepsReaches)
    {
        surface_.restoreFrom("contact", archive, keepsReaches), restoreStep(archive);
        search_.restoreFrom("contact", archive, bodies_.back().firstNode + bodies_.back().mesh->nodeCount());
        settle(), trembling_.restoreFrom("contact", archive, surface_.size(), targets_.size());
    }
    void restoreStep(const core::Archive& archive)
    {
        last_ = archive.getOne<double>("contact.step");
        if (!(last_ > 0)) archive.complain("the last step of contact is not above 0");
        isChanged_ = archive.getOne<std::int64_t>("contact.changed") != 0;
        forget();
    }
    /// The mesh is another one: numbers of samples, targets and nodes no longer hold.
    void forget()
    {
        isSettled_ = false;
        search_.clear(), before_.clear(), atStart_.clear(), pairs_.clear(), friction_.clear(), anchor_.clear(),
            trembling_.clear();
    }
    void settle()
    {
        if (!isSettled_) surface_.settle(), targets_.set(bodies_, kDepth * dx_), isSettled_ = true;
    }
    void look(std::span<const Vec3> x, std::span<const Vec3> v, double dt);
    /// Where nodes were as the step began: a later stage sets off from elsewhere.
    std::span<const Vec3> anchor() const { return anchor_.empty() ? search_.start() : std::span<const Vec3>(anchor_); }
    std::vector<Pair> pairsAt(std::span<const Vec3> x, std::span<const Pair> held = {}) const;
    std::vector<Pair> steadyPairsAt(std::span<const Vec3> x, contact::Trembling& trembling) const;
    double depthAtStart(const Pair& p) const
    {
        const Vec3 y = surface_.probe(p.sample, search_.start());
        return surface_.reach(p.sample) - targets_.locate(p.target, y, search_.start()).phi;
    }
    void take(std::vector<Pair> pairs);
    std::vector<ContactPoint> contactsAt(std::span<const Vec3> x) const { return forces_.contacts(pairs_, x); }
    double energyAt(std::span<const Vec3> x) const;
    std::vector<FrictionPoint> frictionAt(std::span<const Vec3> x) const
    {
        return forces_.friction(contactsAt(x), mu_, anchor());
    }
    const contact::NarrowPhase& near() const { return search_.near(); }
    std::vector<Penetration> penetrationsAt(std::span<const Vec3> x) const
    {
        return near().penetrationsAt(surface_, targets_, x, kReach);
    }
    bool cameUp(const Penetration& s) const
    {
        return effects::cameUp(s.depth - before_[s.sample], forces_.apart(s, search_.start()).norm(), dx_);
    }
    double partFollowed(const contact::Motion& motion, double farthest) const
    {
        if (surface_.isOneFragment()) return kInfinity;
        return contact::partFollowed(motion, surface_.fragmentOfNode(), farthest * h_);
    }
    double mu_, gap_, untangleSpeed_;
    bool closesLips_, drawsApart_;
    double dx_, h_;            // m
    double longest_;           // s: that a step can be
    double last_ = kInfinity;  // s: how long the last step was
    std::span<const core::Body> bodies_;
    contact::ContactSurface surface_;
    contact::Targets targets_;
    ContactForces forces_;
    bool isSettled_ = false;
    bool isFirst_ = true;     // no solve has begun since the last step: nodes are where that left them
    bool isChanged_ = false;  // gaps of lips, or settings, are others than in the last step
    // Of the step at hand.
    contact::ContactSearch search_;
    contact::Trembling trembling_, inSolve_;    // from step to step, and between the solutions of a solve
    std::vector<Pair> pairs_;                   // by rising sample
    std::vector<FrictionPoint> friction_;       // by rising sample
    std::vector<Vec3> anchor_;                  // m: as anchor(), once there was a second begin()
    std::vector<double> before_, atStart_;      // m: depth of all samples, as the solve and as the step began
    double deepest_ = 0, deepestInItself_ = 0;  // m
    mutable Ledger work_;
};

/// What is seen at x, but for targets that would throw a sample out.
std::vector<Pair> Contact::pairsAt(std::span<const Vec3> x, std::span<const Pair> held) const
{
    std::vector<Pair> pairs = near().seenAt(surface_, targets_, x, kReach, held);
    std::erase_if(pairs, [&](const Pair& p) {
        return depthAtStart(p) > knownDepth(p.sample, surface_, before_) + kThrown * dx_;
    });
    return pairs;
}

/// What goes to and fro is held.
std::vector<Pair> Contact::steadyPairsAt(std::span<const Vec3> x, contact::Trembling& trembling) const
{
    std::vector<Pair> pairs = pairsAt(x, trembling.held());
    return trembling.look(pairs, surface_, targets_, x, kHidden * dx_) ? pairsAt(x, trembling.held()) : pairs;
}

/// phi of a tet goes on outside of it, past its sides. A sample that comes in by one of those has had the surface
/// within its reach all along, and is not pushed for that: so no energy comes of it.
void Contact::take(std::vector<Pair> pairs)
{
    pairs_ = std::move(pairs);
    inSolve_.keep(pairs_);
    for (const Pair& p : pairs_)
        if (const double reach = surface_.reach(p.sample); reach > 0 && before_[p.sample] == 0) {
            double& allowance = surface_.memory(p.sample).allowance;
            allowance = std::max(allowance, std::min(depthAtStart(p), reach));
        }
}

/// Finds what may touch within `dt` [s] from x, and what does so at first.
void Contact::look(std::span<const Vec3> x, std::span<const Vec3> v, double dt)
{
    settle();
    if (search_.look(surface_, targets_, x, v, dt)) {
        std::vector<double> now = contact::deepest(penetrationsAt(x), surface_.size());
        before_ = isFirst_ ? std::move(now) : withoutJumps(std::move(now), atStart_, kThrown * dx_, surface_);
        if (isFirst_) atStart_ = before_;
        for (std::size_t i = 0; i < surface_.size(); ++i)
            if (isFirst_ || surface_.memory(i).allowance == SampleMemory::kUnseen)
                surface_.memory(i).see(before_[i], isChanged_ ? 0 : kThrown * dx_);
    }
    std::vector<Pair> pairs = steadyPairsAt(search_.ahead(), trembling_);
    inSolve_ = contact::Trembling(trembling_.held());
    take(std::move(pairs));
    friction_ = frictionAt(x);
}

void Contact::begin(const solver::StepStart& start)
{
    const StageTimer timer(work_, "contact");
    if (!isFirst_ && anchor_.empty()) anchor_.assign(search_.start().begin(), search_.start().end());
    look(start.x, start.v, start.dt);
    isFirst_ = false;
}

/// A tet that has come to lie flat sees nothing. Turned back it may see deep in it what it has seen outside, as phi
/// went on to infinity on the way: that is a wall, which no step leads over.
void Contact::prune(std::span<const Vec3> x)
{
    const StageTimer timer(work_, "contact");
    std::erase_if(pairs_, [&](const Pair& p) { return targets_.isBlind(p.target, x); });
}

bool Contact::refresh(std::span<const Vec3> x)
{
    const StageTimer timer(work_, "contact");
    search_.lookBeside(surface_, targets_, x);
    std::vector<Pair> pairs = contact::withKnown(steadyPairsAt(x, inSolve_), pairs_, surface_, targets_, x);
    const std::vector<ContactPoint> seen = contactsAt(x), all = forces_.contacts(pairs, x);
    const bool moved = contact::haveChanged<ContactPoint>(seen, all, [&](auto& t) { return forces_.force(t); }) ||
                       hidesDeep(seen, all, kHidden * dx_);
    if (moved) take(std::move(pairs));
    std::vector<FrictionPoint> held = frictionAt(x);
    const bool slips = contact::haveChanged<FrictionPoint>(friction_, held, [](auto& h) { return h.spring.push(); });
    if (moved || slips) friction_ = std::move(held);
    return moved || slips;
}

double Contact::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const
{
    const StageTimer timer(work_, "contact");
    return forces_.evaluate(contactsAt(x), friction_, x, gradient);
}

void Contact::linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const
{
    const StageTimer timer(work_, "contact");
    forces_.linearize(contactsAt(x), friction_, x, couplings);
}

/// Of all touches at x, whatever the step knows: so what is held at the end of a step is what the next one begins with.
double Contact::energyAt(std::span<const Vec3> x) const
{
    double energy = 0;
    for (const ContactPoint& t : forces_.contacts(pairsAt(x), x)) energy += forces_.energy(t);
    return energy;
}

/// Contact holds energy; friction takes it, but for what stretches slip.
solver::EnergyFlow Contact::flow(const solver::Leg& leg) const
{
    const StageTimer timer(work_, "contact");
    double along = 0, stretched = 0, rubbed = 0;
    const auto wayOf = [&](const auto& t) { return Vec3(forces_.apart(t, leg.to) - forces_.apart(t, leg.from)); };
    for (const ContactPoint& t : contactsAt(leg.at)) along += forces_.force(t).dot(wayOf(t));
    for (const FrictionPoint& h : friction_) {
        const Vec3 force = h.spring.force(forces_.slip(h, leg.at)), way = wayOf(h);
        along += force.dot(way), rubbed -= force.dot(way);
        const Vec3 before = leg.isFirst ? h.spring.stretch : h.spring.kept(forces_.slip(h, leg.from));
        stretched += force.dot(h.spring.kept(forces_.slip(h, leg.to)) - before);
    }
    const double work = energyAt(leg.from) - energyAt(leg.to) + stretched, dissipated = rubbed + stretched;
    return {work, dissipated, work - dissipated - along};
}

/// Newton's method may come to rest with a thin flap pushed through by one of its tries, or with touches that nobody
/// has looked for since; and what comes so near in a step may be through.
bool Contact::isAdmissible(const solver::WholeStep& way) const
{
    constexpr double kSlack = 2;  // of what a step was expected to be followed over
    const StageTimer timer(work_, "contact");
    if (partFollowed({way.from, way.to}, kSlack * contact::ContactSearch::kFarthest) < 1) return false;
    if (near().farthest(surface_, targets_, way.from, way.to) > kDepth * dx_) return false;
    std::vector<Penetration> through = penetrationsAt(way.to);
    std::erase_if(through, [&](const Penetration& s) {
        return s.depth <= kDeep * dx_ || !isDeeper(s, knownDepth(s.sample, surface_, before_), dx_) || cameUp(s);
    });
    return through.empty() || areResisted(through, contactsAt(way.to), surface_, dx_);
}

void Contact::accept(std::span<const Vec3> x, double, double dt)
{
    const StageTimer timer(work_, "contact");
    last_ = dt, isFirst_ = true, isChanged_ = false;
    deepest_ = deepestInItself_ = 0;
    const std::vector<Penetration> sunk = penetrationsAt(x);
    allowJumps(sunk, contactsAt(x), before_, kThrown * dx_, surface_);
    for (const Penetration& s : sunk) {
        double& most = s.inItself ? deepestInItself_ : deepest_;
        most = std::max(most, s.depth);
        if (s.inItself && cameUp(s)) surface_.memory(s.sample).allowance = s.depth;
    }
    const std::vector<double> depth = contact::deepest(sunk, surface_.size());
    std::vector<Vec3> stretch(surface_.size(), Vec3::Zero());
    for (const FrictionPoint& h : friction_) stretch[h.sample] = h.spring.kept(forces_.slip(h, x));
    anchor_.clear();
    for (std::size_t i = 0; i < surface_.size(); ++i)
        surface_.memory(i).keep(depth[i], stretch[i], untangleSpeed_ * dt);
    // What has sunk deeper than samples are found shall not be thrown out when it comes up.
    for (const Pair& p : pairs_)
        if (depth[p.sample] == 0 && targets_.locate(p.target, surface_.probe(p.sample, x), x).phi < -0.5 * kDepth * dx_)
            surface_.memory(p.sample).allowance = SampleMemory::kBuried;
    // What has come out is touched no more: whoever asks for the energy now asks for that of what is.
    std::erase_if(pairs_, [&](const Pair& p) { return depth[p.sample] == 0; });
    trembling_.keep(pairs_);
}

/// No sample comes nearer to a target than three quarters of the depth in which samples are found, in one step, and
/// what may meet is not followed so far that its way would be cut off. Looks as far ahead as the next step may be long:
/// lists for a whole frame would be endless where steps are short. Where nothing is near, steps are as long as without.
double Contact::largestStep(const solver::State& state, double)
{
    const StageTimer timer(work_, "contact");
    double ahead = std::clamp(kGrowth * last_, kLeast * longest_, longest_);
    look(state.x, state.v, ahead);
    if (near().pairs() == 0 && ahead < longest_) {
        look(state.x, state.v, longest_);
        if (near().pairs() == 0) ahead = longest_;
    }
    const double fastest = near().fastest(surface_, targets_, state.x, state.v);
    const double followed =
        ahead * partFollowed({state.x, contact::moved(state.x, state.v, ahead)}, contact::ContactSearch::kFarthest);
    return std::min(
        {fastest > 0 ? 0.75 * kDepth * dx_ / fastest : kInfinity, followed, ahead < longest_ ? ahead : kInfinity});
}

void Contact::report(Ledger& work, std::map<std::string, double>& measured)
{
    work_.count("contact", "samples", std::int64_t(surface_.size()));
    work_.count("contact", "searches", search_.takeSearches());
    work_.count("contact", "listed", std::int64_t(near().pairs()));
    work_.count("contact", "active", std::int64_t(pairs_.size()));
    measured["contact_depth_m"] = deepest_, measured["contact_self_depth_m"] = deepestInItself_;
    work.add(work_), work_.clear();
}

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene& scene)
{
    scene::requireFrictionFits(scene, scene.file.string() + ": [contact]", values.number("friction"));
    return std::make_unique<Contact>(values, scene);
}

}  // namespace

EffectInfo contact()
{
    return {.table = {"contact", "Bodies and fragments touch each other and themselves.", kContactKeys},
            .stages = "solve, limit on the time step",
            .make = make,
            .bodiesWithout = "bodies pass through each other where they meet: there is no [contact]"};
}

}  // namespace vdbfrac::effects
