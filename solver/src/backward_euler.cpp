#include <vdbfrac/solver/backward_euler.h>

#include "least_mean.h"
#include "node_loops.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

namespace {

/// Phi at one x, with the sizes that tell how small its gradient has to be.
struct Point {
    std::vector<Vec3> x, gradient;
    double phi = 0;         ///< J
    double elastic = 0;     ///< J
    double phiNoise = 0;    ///< J: what rounding alone can change phi by
    double norm = 0;        ///< N: of the gradient at free nodes
    double forceScale = 0;  ///< N: largest of inertia, elastic and outer force
    double noise = 0;       ///< N: what rounding alone can leave of the gradient
};

/// Farthest that a node is in one place from where it is in the other [m].
double farthestMove(std::span<const Vec3> a, std::span<const Vec3> b)
{
    return std::sqrt(orderedMax(a.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i) most = std::max(most, (a[i] - b[i]).squaredNorm());
        return most;
    }));
}

}  // namespace

class BackwardEuler::Newton {
public:
    Newton(const ElasticOperator& elastic, const NewtonSettings& settings)
        : settings_(settings), linear_(elastic, settings.linearMethod, settings.linearPrecision)
    {
        rebind(elastic);
    }

    void rebind(const ElasticOperator& elastic)
    {
        elastic_ = &elastic;
        linear_.rebind(elastic);
        for (auto* v : {&predicted_, &outer_, &direction_, &here_.x, &here_.gradient, &there_.x, &there_.gradient,
                        &report_.reaction})
            v->resize(elastic.nodeCount());
    }

    void begin(const State& state, double dt, const System& system);
    const StepReport& run(State& state);
    double residual(std::span<const Vec3> x)
    {
        std::copy(x.begin(), x.end(), here_.x.begin());
        evaluate(here_);
        return relative(here_);
    }
    std::size_t bytes() const { return 8 * elastic_->nodeCount() * sizeof(Vec3) + tangent_.bytes() + linear_.bytes(); }

private:
    void evaluate(Point& p);
    void measureForces(Point& p);
    /// Not where forces overflow: there any x would look solved.
    bool small(const Point& p) const
    {
        return p.norm <= settings_.tolerance * p.forceScale + p.noise && std::isfinite(p.forceScale + p.noise);
    }
    static double relative(const Point& p, double norm)
    {
        const double scale = std::max(p.forceScale, p.noise);
        return std::isinf(scale) ? scale : norm > 0 ? norm / scale : norm;
    }
    static double relative(const Point& p) { return relative(p, p.norm); }
    void freezeLooseParts();
    void hold(Point& p) const;
    double jump() const;
    void lift();
    enum class Search { accepted, failed, crease };
    bool improve();
    bool descend();
    bool followCrease();
    void combineSides();
    double freeNorm(std::span<const Vec3> gradient) const;
    LinearStatus solve(std::span<const Vec3> gradient, std::vector<Vec3>& direction, double tolerance);
    double enough() const;
    Search search(std::span<const Vec3> gradient);
    void balanceMomentum();
    void finish(State& state);

    const ElasticOperator* elastic_ = nullptr;
    NewtonSettings settings_;
    LinearSolver linear_;
    Tangent tangent_;
    StepReport report_;
    std::vector<Vec3> predicted_, outer_, direction_;
    Point here_, there_;
    struct Part {
        Vec3 force;
        double inertia;
        bool held;
    };
    std::vector<Part> parts_;
    /// The gradient on one side of a crease, and the direction of Newton's method for it.
    struct Side {
        std::vector<Vec3> gradient, direction;
    };
    std::vector<Side> sides_;  // kept for their memory
    std::size_t sideCount_ = 0;
    std::vector<Vec3> combined_;  // the shortest mean of their gradients

    // Of the step at hand.
    double dt_ = 0, inertia_ = 0;
    HessianShares shares_;
    bool prepared_ = false;  // there is a preconditioner of this step
    double reach_ = 0;       // m: no farther away a gradient that no longer descends is taken for one beyond a crease
    // N: size of the shortest mean of gradients where here_ is a minimum at a crease, or below 0.
    double crease_ = -1;
    std::span<Potential* const> potentials_;
    const Boundary* boundary_ = nullptr;
    std::vector<std::uint8_t> fixed_;  // nodes that do not answer: held ones, and frozen ones
};

void BackwardEuler::Newton::begin(const State& state, double dt, const System& system)
{
    constexpr double kReach = 1e-2;  // cells: Newton's method is past the trouble of a bad start there
    dt_ = dt;
    inertia_ = 1 / (dt * dt);
    potentials_ = system.potentials;
    boundary_ = &system.boundary;
    shares_ = {};
    prepared_ = false;
    crease_ = -1;
    reach_ = kReach * elastic_->h();
    std::vector<Vec3> reaction = std::move(report_.reaction);  // keeps its memory
    report_ = {};
    report_.reaction = std::move(reaction);
    fixed_ = boundary_->fixed;
    if (!std::isfinite(dt)) freezeLooseParts();
    for (Potential* potential : potentials_) {
        potential->begin({state.x, state.v, dt, *elastic_});
        const HessianShares h = potential->hessian();
        shares_ = {shares_.mass + h.mass, shares_.stiffness + h.stiffness};
    }
    const double drift = std::isfinite(dt) ? dt : 0;
    eachNode<double>(predicted_.size(), [&](std::size_t i) {
        predicted_[i] = state.x[i] + drift * state.v[i];
        here_.x[i] = predicted_[i];
    });
}

/// A part that nothing holds has no static equilibrium, or infinitely many: it stays where it is.
void BackwardEuler::Newton::freezeLooseParts()
{
    const auto& part = boundary_->part;
    if (part.empty()) return;
    std::vector<std::uint8_t> held(*std::max_element(part.begin(), part.end()) + 1, 0);
    for (std::size_t i = 0; i < part.size(); ++i) held[part[i]] |= boundary_->fixed[i];
    for (std::size_t i = 0; i < part.size(); ++i) fixed_[i] |= !held[part[i]];
    report_.frozenNodes =
        std::size_t(std::count_if(part.begin(), part.end(), [&](std::uint32_t p) { return !held[p]; }));
}

void BackwardEuler::Newton::evaluate(Point& p)
{
    eachNode<double>(p.x.size(), [&](std::size_t i) {
        p.gradient[i].setZero();
        outer_[i] = -boundary_->force[i];
    });
    p.elastic = p.phi = elastic_->evaluate(p.x, p.gradient, &tangent_, shares_.stiffness);
    double phiScale = std::abs(p.elastic);
    for (Potential* potential : potentials_) {
        const double value = potential->evaluate(p.x, outer_);
        p.phi += value;
        phiScale += std::abs(value);
    }
    p.phiNoise = phiScale;
    measureForces(p);
}

/// Adds inertia and outer forces to the gradient, which holds the elastic ones, and measures all of them in one pass.
void BackwardEuler::Newton::measureForces(Point& p)
{
    // Of the magnitudes a nodal force is added from: some ten roundings of a double.
    constexpr double kRounding = 2e-15;
    constexpr double kPhiRounding = 1e-14;  // of the magnitudes phi is added from
    enum { elastic, outer, inertia, total, noise, stretched, kinetic, work, sums };
    const std::span<const double> mass = elastic_->mass(), stiffness = elastic_->stiffness();
    const auto sum = orderedSums<sums>(p.x.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::array<double, sums> s{};
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 moved = p.x[i] - predicted_[i], accelerating = mass[i] * inertia_ * moved;
            const double size2 = p.x[i].squaredNorm(), k = stiffness[i] + mass[i] * inertia_;
            s[kinetic] += 0.5 * accelerating.dot(moved);
            s[work] += boundary_->force[i].dot(p.x[i]);
            s[stretched] += stiffness[i] * size2;
            const Vec3 own = p.gradient[i];
            p.gradient[i] += outer_[i] + accelerating;
            if (fixed_[i]) continue;
            s[elastic] += own.squaredNorm();
            s[outer] += outer_[i].squaredNorm();
            s[inertia] += accelerating.squaredNorm();
            s[total] += p.gradient[i].squaredNorm();
            s[noise] += k * k * size2;
        }
        return s;
    });
    p.phi += sum[kinetic] - sum[work];
    p.norm = std::sqrt(sum[total]);
    p.forceScale = std::sqrt(std::max({sum[elastic], sum[outer], sum[inertia]}));
    p.noise = kRounding * std::sqrt(sum[noise]);
    // F is rounded by |x| / h units, so a small strain energy K e^2 is off by K e times that.
    p.phiNoise = kPhiRounding * (p.phiNoise + sum[kinetic] + std::abs(sum[work])) +
                 kRounding * std::sqrt(sum[stretched] * std::abs(p.elastic));
}

/// Takes the held nodes to their targets.
void BackwardEuler::Newton::hold(Point& p) const
{
    eachNode<double>(p.x.size(), [&](std::size_t i) {
        if (boundary_->fixed[i]) p.x[i] = boundary_->target[i];
    });
}

/// Farthest that a held node is from where it would have gone by itself [m].
double BackwardEuler::Newton::jump() const
{
    return orderedMax(predicted_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i)
            if (boundary_->fixed[i]) most = std::max(most, (boundary_->target[i] - predicted_[i]).norm());
        return most;
    });
}

/// The start of a step in which held nodes jump: the linearised body follows them as a whole. Moved alone they would
/// crush or tear the cells next to them, and Newton's method would start from there; it does so if that is lower.
void BackwardEuler::Newton::lift()
{
    evaluate(here_);
    eachNode<double>(direction_.size(), [&](std::size_t i) {
        direction_[i] = boundary_->fixed[i] ? Vec3(boundary_->target[i] - here_.x[i]) : Vec3::Zero();
    });
    elastic_->addProduct(tangent_, direction_, here_.gradient);
    there_.x = here_.x;
    hold(there_);
    const bool definite =
        solve(here_.gradient, direction_, settings_.linearTolerance) != LinearStatus::negativeCurvature;
    ++report_.newtonIterations;
    eachNode<double>(here_.x.size(), [&](std::size_t i) { here_.x[i] -= direction_[i]; });
    hold(here_);
    prepared_ = false;
    if (definite) {
        evaluate(there_);
        evaluate(here_);
        if (here_.phi < there_.phi) return;
    }
    std::swap(here_, there_);
    evaluate(here_);
}

/// How well to solve: no further than a fraction of what would meet the Newton tolerance if Phi were quadratic.
double BackwardEuler::Newton::enough() const
{
    constexpr double kShare = 0.2, kLoosest = 0.1;
    return std::max(settings_.linearTolerance,
                    std::min(kShare * settings_.tolerance * here_.forceScale / here_.norm, kLoosest));
}

/// Solves for the direction that belongs to a gradient.
LinearStatus BackwardEuler::Newton::solve(std::span<const Vec3> gradient, std::vector<Vec3>& direction,
                                          double tolerance)
{
    const LinearReport r = linear_.solve({*elastic_, tangent_, inertia_ + shares_.mass, fixed_}, gradient, direction,
                                         {tolerance, settings_.linearIterations}, prepared_);
    prepared_ = true;
    report_.linearIterations += r.iterations;
    report_.multigridSystems += r.method == LinearMethod::multigrid;
    return r.status;
}

/// One Newton iteration. The exact tangent is projected only where it shows negative curvature or does not descend.
/// A capped linear solve still gives a direction of descent; whether it was good enough shows in the Newton residual.
bool BackwardEuler::Newton::improve()
{
    if (settings_.tangent == NewtonTangent::exact) {
        if (descend()) return true;
        prepared_ = false;
    }
    if (settings_.tangent == NewtonTangent::warped) {
        elastic_->warp(tangent_);
    } else {
        elastic_->project(tangent_);
        ++report_.projections;
    }
    return descend();
}

bool BackwardEuler::Newton::descend()
{
    if (solve(here_.gradient, direction_, enough()) == LinearStatus::negativeCurvature) return false;
    const Search found = search(here_.gradient);
    return found == Search::accepted || (found == Search::crease && followCrease());
}

/// Where s2 + s3 of a tet passes 0, its rotation jumps and with it its force. If its cell is dilated there, Phi has a
/// valley with a crease for a bottom, and no gradient near it is small. What is small is a weighted mean of the
/// gradients on its sides, in the metric of the tangent: the direction for it leads along the crease, and where it is 0
/// none leads down (Lemarechal 1977; Burke, Lewis, Overton 2005, section 2). False when it could not be followed;
/// there_ is beyond a crease.
bool BackwardEuler::Newton::followCrease()
{
    constexpr double kNear = 1e-4;    // cells: as near as that the minimum is known in the end
    constexpr double kMoves = 4;      // how much farther than the last move sides are looked for
    constexpr double kCloser = 0.25;  // how much nearer, where what looked like one was none
    const double near = kNear * elastic_->h(), solved = settings_.tolerance * here_.forceScale + here_.noise;
    const auto add = [&](std::span<const Vec3> gradient) -> Side& {
        if (sides_.size() == sideCount_) sides_.emplace_back();
        sides_[sideCount_].gradient.assign(gradient.begin(), gradient.end());
        return sides_[sideCount_++];
    };
    sideCount_ = 0;
    add(here_.gradient).direction = direction_;
    double farthest = 0;
    while (sideCount_ < kMostMeans) {
        farthest = std::max(farthest, farthestMove(here_.x, there_.x));
        Side& beyond = add(there_.gradient);
        beyond.direction.resize(here_.x.size());
        evaluate(here_);  // the tangent belongs to it again
        if (solve(beyond.gradient, beyond.direction, enough()) == LinearStatus::negativeCurvature) return false;
        combineSides();
        const double least = freeNorm(combined_);
        // Bent, not creased: nothing but a shorter step.
        if (!(dot(direction_, combined_) > 0 && least <= here_.norm)) {
            reach_ = kCloser * farthest;
            direction_ = sides_[0].direction;
            if (search(here_.gradient) == Search::accepted) return true;
            break;
        }
        if (least <= solved) {
            if (farthest <= near) crease_ = least;
            reach_ = near;  // or look again, with sides as near as that
            return true;
        }
        const Search found = search(combined_);
        if (found == Search::accepted)
            reach_ = std::max(near, std::min(reach_, kMoves * farthestMove(here_.x, there_.x)));
        if (found != Search::crease) return found == Search::accepted;
    }
    evaluate(here_);
    return false;
}

/// The shortest weighted mean of the gradients of the sides, and its direction.
void BackwardEuler::Newton::combineSides()
{
    const Eigen::Index n = Eigen::Index(sideCount_);
    Eigen::MatrixXd products(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j <= i; ++j)
            products(i, j) = products(j, i) =
                0.5 * (dot(sides_[std::size_t(i)].gradient, sides_[std::size_t(j)].direction) +
                       dot(sides_[std::size_t(j)].gradient, sides_[std::size_t(i)].direction));
    const Eigen::VectorXd weight = leastMean(products);
    combined_.resize(here_.x.size());
    eachNode<double>(here_.x.size(), [&](std::size_t node) {
        combined_[node].setZero(), direction_[node].setZero();
        for (Eigen::Index i = 0; i < n; ++i) {
            combined_[node] += weight[i] * sides_[std::size_t(i)].gradient[node];
            direction_[node] += weight[i] * sides_[std::size_t(i)].direction[node];
        }
    });
}

double BackwardEuler::Newton::freeNorm(std::span<const Vec3> gradient) const
{
    return std::sqrt(
        nodeSum<double>(gradient.size(), [&](std::size_t i) { return fixed_[i] ? 0 : gradient[i].squaredNorm(); }));
}

/// Looks along -direction_, which belongs to the gradient, for a point that is lower.
BackwardEuler::Newton::Search BackwardEuler::Newton::search(std::span<const Vec3> gradient)
{
    constexpr int kMostHalvings = 20;
    constexpr double kArmijo = 1e-4;
    const double slope = dot(direction_, gradient);  // the direction is 0 at fixed nodes
    double step = 1;
    for (int halving = 0; slope > 0 && halving <= kMostHalvings; ++halving, step *= 0.5) {
        eachNode<double>(here_.x.size(), [&](std::size_t i) { there_.x[i] = here_.x[i] - step * direction_[i]; });
        evaluate(there_);
        const double change = there_.phi - here_.phi, noise = here_.phiNoise + there_.phiNoise;
        const bool descends = change <= -kArmijo * step * slope;
        const bool level = std::abs(change) <= noise && there_.norm <= here_.norm * (1 + 1e-9) + there_.noise;
        if (descends || level) {
            std::swap(here_, there_);
            return Search::accepted;
        }
        ++report_.lineSearchSteps;
        if (dot(direction_, there_.gradient) < 0 && farthestMove(here_.x, there_.x) <= reach_) return Search::crease;
    }
    evaluate(here_);  // the tangent belongs to it again
    return Search::failed;
}

/// Shifts each part without fixed nodes by what zeroes its summed gradient: internal forces cancel in the sum and do
/// not change under a shift, so only inertia answers. Sums run over nodes in order.
void BackwardEuler::Newton::balanceMomentum()
{
    if (!(inertia_ > 0)) return;
    const auto& labels = boundary_->part;
    const auto mass = elastic_->mass();
    parts_.assign(labels.empty() ? 1 : *std::max_element(labels.begin(), labels.end()) + 1, {Vec3::Zero(), 0, false});
    for (std::size_t i = 0; i < here_.x.size(); ++i) {
        Part& part = parts_[labels.empty() ? 0 : labels[i]];
        part.force += here_.gradient[i];
        part.inertia += mass[i] * inertia_;
        part.held = part.held || boundary_->fixed[i];
    }
    eachNode<double>(here_.x.size(), [&](std::size_t i) {
        const Part& part = parts_[labels.empty() ? 0 : labels[i]];
        if (!part.held && part.inertia > 0) here_.x[i] -= part.force / part.inertia;
    });
}

void BackwardEuler::Newton::finish(State& state)
{
    balanceMomentum();
    report_.residual = crease_ >= 0 ? relative(here_, crease_) : relative(here_);
    report_.leastResidual = std::min(report_.leastResidual, report_.residual);
    report_.creases = crease_ >= 0;
    report_.elasticEnergy = here_.elastic;
    eachNode<double>(here_.x.size(), [&](std::size_t i) {
        report_.reaction[i] = boundary_->fixed[i] ? here_.gradient[i] : Vec3::Zero();
        if (std::isfinite(dt_)) state.v[i] = (here_.x[i] - state.x[i]) / dt_;
        state.x[i] = here_.x[i];
    });
}

const StepReport& BackwardEuler::Newton::run(State& state)
{
    // Of a cell: strains for which the linearised body is a better start than one at rest.
    constexpr double kJump = 0.1;
    if (jump() > kJump * elastic_->h()) {
        lift();
    } else {
        hold(here_);
        evaluate(here_);
    }
    report_.leastResidual = relative(here_);
    while (!small(here_) && crease_ < 0) {
        if (report_.newtonIterations == settings_.iterations || !improve()) {
            report_.status = StepStatus::capped;
            break;
        }
        ++report_.newtonIterations;
        report_.leastResidual = std::min(report_.leastResidual, relative(here_));
    }
    finish(state);
    return report_;
}

BackwardEuler::BackwardEuler(const ElasticOperator& elastic, const NewtonSettings& settings)
    : newton_(std::make_unique<Newton>(elastic, settings))
{
}
BackwardEuler::~BackwardEuler() = default;
BackwardEuler::BackwardEuler(BackwardEuler&&) noexcept = default;
BackwardEuler& BackwardEuler::operator=(BackwardEuler&&) noexcept = default;

void BackwardEuler::rebind(const ElasticOperator& elastic) { newton_->rebind(elastic); }

const StepReport& BackwardEuler::step(State& state, double dt, const System& system)
{
    newton_->begin(state, dt, system);
    return newton_->run(state);
}

double BackwardEuler::residual(const State& state, double dt, const System& system, std::span<const Vec3> x)
{
    newton_->begin(state, dt, system);
    return newton_->residual(x);
}

std::size_t BackwardEuler::bytes() const { return newton_->bytes(); }

StepReport stepBackwardEuler(const ElasticOperator& elastic, State& state, double dt, const System& system,
                             const NewtonSettings& settings)
{
    return BackwardEuler(elastic, settings).step(state, dt, system);
}

}  // namespace vdbfrac::solver
