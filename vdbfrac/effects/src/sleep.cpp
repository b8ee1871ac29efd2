// Sleep: fragments that lie still are no longer solved for, until something pushes them.
//
// Islands are fragments that contact joins. An island falls asleep when in each of its fragments no node has had, for a
// while, more kinetic energy than the heaviest has at v_s: nodes of thin cut tets, which weigh next to nothing, may
// tremble. What it still moves with is lost. A fragment wakes when the forces on it, their sum or their moments, differ
// from those in the first step of its sleep (or, in that first step, from those when it fell asleep) by more than what
// would bring it to v_s within a frame, when it is cut again, and when what may tear it gets weaker over time. Damping
// is no push: what lies still has none.
#include "all.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/error.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"speed", Type::number, "m/s",
     "Speed below which a fragment may fall asleep; default: .01 sqrt(g h) with gravity g and spacing h.",
     scene::kOptional, 0, kInfinity, true},
    {"after", Type::number, "s", "How long it has to stay as slow as that.", "0.5", 0, kInfinity, true},
};

/// What pushes a fragment from outside.
struct Push {
    Vec3 force = Vec3::Zero();   // N, sum of f
    Mat3 moment = Mat3::Zero();  // N m, sum of f (x - center)^T
};

/// Below which a fragment may fall asleep [m/s].
double speedOf(const scene::Values& values, const scene::Scene& scene)
{
    if (values.has("speed")) return values.number("speed");
    const scene::Values* gravity = scene.table("gravity");
    if (const double g = gravity ? gravity->vector("acceleration").norm() : 0; g > 0)
        return 0.01 * std::sqrt(g * scene.grid.coarsening * scene.grid.voxelSize);
    throw InputError({scene.file.string() + ": [sleep]",
                      "speed is not set, and cannot be derived because the scene has no gravity", "",
                      "add speed, in m/s"});
}

/// How resistance to fracture changes over time.
scene::Curve resistanceOf(const scene::Scene& scene)
{
    const scene::Values* fracture = scene.table("fracture");
    return fracture && fracture->has("keys") ? fracture->curve("keys") : scene::Curve();
}

/// What is kept of each fragment.
struct Quiet {
    double time = 0;                     // s: since when it is slow
    bool asleep = false, known = false;  // when the last step ended; has it been for a step, with this push? Else as
                                         // it fell asleep
    Push push;
};

/// What a fragment is at the end of a step.
struct FragmentState {
    double mass = 0, inertia = 0;        // kg, kg m^2
    double heaviest = 0, liveliest = 0;  // of its nodes: kg; m v^2, kg m^2/s^2
    Vec3 center = Vec3::Zero();
    Push push;
};

class Sleep : public core::Effect, public core::SleepStage, public core::Persistent {
public:
    Sleep(const scene::Values& values, const scene::Scene& scene)
        : speed_(speedOf(values, scene)),
          after_(values.number("after")),
          frame_(1 / scene.time.fps),
          resistance_(resistanceOf(scene))
    {
    }

    std::string name() const override { return "sleep"; }
    void join(core::Stages& stages) override
    {
        stages.sleep.push_back(this);
        stages.persistent.push_back(this);
    }
    void wake(const core::SleepContext& context, std::span<std::uint8_t> asleep) override;
    void decide(const core::SleepContext& context, std::span<std::uint8_t> asleep) override;
    void save(std::span<const core::Body>, core::Archive& archive) const override;
    void restoreFrom(const core::Archive& archive, std::span<const core::Body>) override;

private:
    std::vector<FragmentState> measure(const core::SleepContext& context, std::size_t fragments, bool pushes) const;
    bool isPushed(const Push& now, const Push& before, const FragmentState& state) const;
    void forgetWoken(std::span<const std::uint8_t> asleep);
    void fallAsleep(const core::SleepContext& context, std::span<std::uint8_t> asleep);

    double speed_, after_, frame_;  // m/s, s, s
    scene::Curve resistance_;
    std::vector<Quiet> quiet_;  // of each fragment
};

template <class F>
void eachNode(std::span<const core::Body> bodies, const F& f)
{
    for (std::size_t b = 0; b < bodies.size(); ++b)
        for (std::size_t i = 0; i < bodies[b].fragments.ofNode().size(); ++i)
            f(bodies[b].firstNode + i, bodies[b].fragments.ofNode()[i]);
}

/// With `pushes`, what potentials do to each fragment too.
std::vector<FragmentState> Sleep::measure(const core::SleepContext& context, std::size_t fragments, bool pushes) const
{
    std::vector<FragmentState> states(fragments);
    eachNode(context.bodies, [&](std::size_t n, std::uint32_t f) {
        states[f].mass += context.mass[n];
        states[f].center += context.mass[n] * context.x[n];
        states[f].heaviest = std::max(states[f].heaviest, context.mass[n]);
        states[f].liveliest = std::max(states[f].liveliest, context.mass[n] * context.v[n].squaredNorm());
    });
    if (!pushes) return states;
    for (FragmentState& p : states)
        if (p.mass > 0) p.center /= p.mass;
    std::vector<Vec3> gradient(context.x.size(), Vec3::Zero());
    for (const solver::Potential* potential : context.potentials) {
        const auto [mass, stiffness] = potential->damping();
        if (mass == 0 && stiffness == 0) (void)potential->evaluate(context.x, gradient);
    }
    eachNode(context.bodies, [&](std::size_t n, std::uint32_t f) {
        const Vec3 arm = context.x[n] - states[f].center;
        states[f].push.force -= gradient[n];
        states[f].push.moment -= gradient[n] * arm.transpose();
        states[f].inertia += context.mass[n] * arm.squaredNorm();
    });
    return states;
}

void Sleep::decide(const core::SleepContext& context, std::span<std::uint8_t> asleep)
{
    forgetWoken(asleep);
    const std::vector<FragmentState> states = measure(context, asleep.size(), false);
    bool canSleep = false;
    for (std::size_t f = 0; f < asleep.size(); ++f) {
        const FragmentState& s = states[f];
        const bool slow = s.mass > 0 && s.liveliest < s.heaviest * speed_ * speed_ && !context.held[f];
        quiet_[f].time = slow && context.converged ? quiet_[f].time + context.dt : 0;
        canSleep = canSleep || (!asleep[f] && quiet_[f].time >= after_);
    }
    if (canSleep) fallAsleep(context, asleep);
    for (std::size_t f = 0; f < asleep.size(); ++f) quiet_[f].asleep = asleep[f];
}

/// What was cut again while it slept has been woken, and is another piece now.
void Sleep::forgetWoken(std::span<const std::uint8_t> asleep)
{
    quiet_.resize(asleep.size());
    for (std::size_t f = 0; f < asleep.size(); ++f)
        if (quiet_[f].asleep && !asleep[f]) quiet_[f] = {};
}

bool Sleep::isPushed(const Push& now, const Push& before, const FragmentState& state) const
{
    const double arm = std::sqrt(state.inertia / state.mass);
    const double change = (now.force - before.force).norm() + (arm > 0 ? (now.moment - before.moment).norm() / arm : 0);
    return change * frame_ > state.mass * speed_;
}

void Sleep::wake(const core::SleepContext& context, std::span<std::uint8_t> asleep)
{
    if (resistance_.at(context.time) < resistance_.at(context.time - context.dt)) std::ranges::fill(asleep, 0);
    forgetWoken(asleep);
    const std::vector<FragmentState> states = measure(context, asleep.size(), true);
    for (std::size_t f = 0; f < asleep.size(); ++f) {
        Quiet& quiet = quiet_[f];
        if (!asleep[f]) {
            quiet.known = false;
        } else if (isPushed(states[f].push, quiet.push, states[f])) {
            asleep[f] = 0, quiet = {};
        } else if (!quiet.known) {
            quiet.known = true, quiet.push = states[f].push;
        }
    }
}

/// Puts the islands to sleep all of whose fragments have lain still for long enough. What a grip holds joins none: it
/// does not move by itself.
void Sleep::fallAsleep(const core::SleepContext& context, std::span<std::uint8_t> asleep)
{
    std::vector<solver::Coupling> couplings;
    for (const solver::Potential* potential : context.potentials) potential->linearize(context.x, couplings);
    std::vector<std::uint32_t> fragmentOf(context.x.size());
    eachNode(context.bodies, [&](std::size_t n, std::uint32_t f) { fragmentOf[n] = f; });
    DisjointSets islands(asleep.size());
    for (const solver::Coupling& c : couplings) {
        std::uint32_t first = ~0u;
        for (std::size_t a = 0; a < solver::Coupling::kNodes; ++a) {
            const std::uint32_t f = fragmentOf[c.node[a]];
            if (c.weight[a] == 0 || context.held[f]) continue;
            if (first == ~0u) first = f;
            islands.join(first, f);
        }
    }
    std::vector<std::uint8_t> awake(asleep.size(), 0);
    for (std::uint32_t f = 0; f < asleep.size(); ++f)
        if (!asleep[f] && quiet_[f].time < after_) awake[islands.find(f)] = 1;
    std::vector<std::uint32_t> falling;
    for (std::uint32_t f = 0; f < asleep.size(); ++f)
        if (!asleep[f] && !awake[islands.find(f)]) falling.push_back(f);
    if (falling.empty()) return;
    const std::vector<FragmentState> states = measure(context, asleep.size(), true);
    for (const std::uint32_t f : falling) asleep[f] = 1, quiet_[f].push = states[f].push;
}

void Sleep::save(std::span<const core::Body>, core::Archive& archive) const
{
    std::vector<double> numbers;
    for (const Quiet& q : quiet_) {
        numbers.insert(numbers.end(), {q.time, double(q.asleep), double(q.known)});
        numbers.insert(numbers.end(), q.push.force.begin(), q.push.force.end());
        numbers.insert(numbers.end(), q.push.moment.data(), q.push.moment.data() + 9);
    }
    archive.put("sleep.quiet", numbers);
}

void Sleep::restoreFrom(const core::Archive& archive, std::span<const core::Body>)
{
    constexpr std::size_t kNumbers = 15;
    const auto numbers = archive.get<double>("sleep.quiet");
    if (numbers.size() % kNumbers != 0 ||
        !std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); }))
        archive.complain("what fragments keep for sleep is out of range");
    quiet_.assign(numbers.size() / kNumbers, {});
    for (std::size_t f = 0; f < quiet_.size(); ++f) {
        const double* const own = numbers.data() + kNumbers * f;
        quiet_[f] = {own[0], own[1] != 0, own[2] != 0, {Vec3(own + 3), Mat3(own + 6)}};
    }
}

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene& scene)
{
    if (scene.solver.integrator == scene::Integrator::statics)
        throw InputError({scene.file.string() + ": [sleep]", "nothing moves under integrator = \"static\"", "",
                          "leave out [sleep], or take another integrator"});
    return std::make_unique<Sleep>(values, scene);
}

}  // namespace

EffectInfo sleep()
{
    return {{"sleep", "Fragments at rest are not simulated until something wakes them.", kKeys}, "sleep", make};
}

}  // namespace vdbfrac::effects
