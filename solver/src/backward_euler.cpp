#include <vdbfrac/solver/backward_euler.h>

#include "shortest_mean.h"
#include "node_loops.h"
#include "objective.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

namespace {

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
        objective_.rebind(elastic);
        linear_.rebind(elastic);
        for (auto* v : {&direction_, &here_.x, &here_.gradient, &there_.x, &there_.gradient, &report_.reaction})
            v->resize(elastic.nodeCount());
    }

    void begin(const State& state, double dt, const System& system);
    const StepReport& run(State& state);
    double residual(std::span<const Vec3> x)
    {
        std::copy(x.begin(), x.end(), here_.x.begin());
        objective_.evaluate(here_);
        return relative(here_);
    }
    std::size_t bytes() const { return 6 * direction_.size() * sizeof(Vec3) + objective_.bytes() + linear_.bytes(); }

private:
    /// Not where forces overflow: there any x would look solved. The norm alone does not see a light piece beside a
    /// hard one.
    bool isConverged(const Point& p, double tolerance)
    {
        constexpr double kOff = 20;  // cells, at a tolerance of 1
        return p.norm <= tolerance * p.forceScale + p.noise && std::isfinite(p.forceScale + p.noise) &&
               (p.norm <= p.noise || objective_.farthest(p) <= kOff * tolerance * objective_.elastic().h());
    }
    /// Beyond what rounding leaves, so it is at most the tolerance where the norm is converged. NaN stays NaN.
    static double relative(const Point& p, double norm)
    {
        const double scale = std::max(p.forceScale, p.noise);
        return std::isinf(scale) ? scale : norm <= p.noise ? 0 : (norm - p.noise) / scale;
    }
    static double relative(const Point& p) { return relative(p, p.norm); }
    void lift();
    void makeTangent();
    void descendToRest(double tolerance);
    enum class Search { accepted, failed, crease };
    bool improve();
    bool descend();
    bool followCrease();
    void combineSides();
    double freeNorm(std::span<const Vec3> gradient) const;
    LinearStatus solve(std::span<const Vec3> gradient, std::vector<Vec3>& direction, double tolerance);
    double forcingTerm() const;
    Search lineSearch(std::span<const Vec3> gradient);
    void finish(State& state);

    NewtonSettings settings_;
    Objective objective_;
    LinearSolver linear_;
    StepReport report_;
    std::vector<Vec3> direction_;
    Point here_, there_;
    /// The gradient on one side of a crease, and the direction of Newton's method for it.
    struct Side {
        std::vector<Vec3> gradient, direction;
    };
    std::vector<Side> sides_;  // kept for their memory
    std::size_t sideCount_ = 0;
    std::vector<Vec3> combined_;  // the shortest mean of their gradients

    // Of the step at hand.
    int most_ = 0;                               // iterations after which it is given up
    NewtonTangent made_ = NewtonTangent::exact;  // as the tangent of this iteration is
    bool prepared_ = false;                      // there is a preconditioner of this step
    double reach_ = 0;  // m: no farther away a gradient that no longer descends is taken for one beyond a crease
    // N: size of the shortest mean of gradients where here_ is a minimum at a crease, or below 0.
    double crease_ = -1;
};

void BackwardEuler::Newton::begin(const State& state, double dt, const System& system)
{
    constexpr double kReach = 1e-2;  // cells: Newton's method is past the trouble of a bad start there
    objective_.begin(state, dt, system);
    prepared_ = false;
    crease_ = -1;
    reach_ = kReach * objective_.elastic().h();
    std::vector<Vec3> reaction = std::move(report_.reaction);  // keeps its memory
    report_ = {};
    report_.reaction = std::move(reaction);
    report_.frozenNodes = objective_.frozenNodes();
    std::copy(objective_.predicted().begin(), objective_.predicted().end(), here_.x.begin());
}

/// The start of a step in which held nodes jump: the linearised body follows them as a whole. Moved alone they would
/// crush or tear the cells next to them, and Newton's method would start from there; it does so if that is lower.
void BackwardEuler::Newton::lift()
{
    const Boundary& boundary = objective_.boundary();
    objective_.evaluate(here_);
    eachNode<double>(direction_.size(), [&](std::size_t i) {
        direction_[i] = boundary.fixed[i] ? Vec3(boundary.target[i] - here_.x[i]) : Vec3::Zero();
    });
    objective_.addProduct(direction_, here_.gradient);
    there_.x = here_.x;
    objective_.hold(there_);
    const bool definite =
        solve(here_.gradient, direction_, settings_.linearTolerance) != LinearStatus::negativeCurvature;
    ++report_.newtonIterations;
    eachNode<double>(here_.x.size(), [&](std::size_t i) { here_.x[i] -= direction_[i]; });
    objective_.hold(here_);
    prepared_ = false;
    if (definite) {
        objective_.evaluate(there_);
        objective_.evaluate(here_);
        if (here_.phi < there_.phi) return;
    }
    std::swap(here_, there_);
    objective_.evaluate(here_);
}

/// How well to solve: no further than a fraction of what would meet the Newton tolerance if Phi were quadratic.
double BackwardEuler::Newton::forcingTerm() const
{
    constexpr double kShare = 0.2, kLoosest = 0.1;
    return std::max(settings_.linearTolerance,
                    std::min(kShare * settings_.tolerance * here_.forceScale / here_.norm, kLoosest));
}

/// Solves for the direction that belongs to a gradient.
LinearStatus BackwardEuler::Newton::solve(std::span<const Vec3> gradient, std::vector<Vec3>& direction,
                                          double tolerance)
{
    const LinearReport r =
        linear_.solve(objective_.system(), gradient, direction, {tolerance, settings_.linearIterations}, prepared_);
    prepared_ = true;
    report_.linearIterations += r.iterations;
    report_.multigridSystems += r.method == LinearMethod::multigrid;
    return r.status;
}

/// One Newton iteration. The exact tangent is projected only where it shows negative curvature or does not descend.
/// A capped linear solve still gives a direction of descent; whether it was good enough shows in the Newton residual.
bool BackwardEuler::Newton::improve()
{
    made_ = NewtonTangent::exact;
    if (settings_.tangent == NewtonTangent::exact) {
        if (descend()) return true;
        prepared_ = false;
    }
    made_ = settings_.tangent == NewtonTangent::warped ? NewtonTangent::warped : NewtonTangent::projected;
    makeTangent();
    report_.projections += made_ == NewtonTangent::projected;
    return descend();
}

/// Of what was evaluated last.
void BackwardEuler::Newton::makeTangent()
{
    if (made_ == NewtonTangent::warped) objective_.warpTangent();
    if (made_ == NewtonTangent::projected) objective_.projectTangent();
}

bool BackwardEuler::Newton::descend()
{
    if (solve(here_.gradient, direction_, forcingTerm()) == LinearStatus::negativeCurvature) return false;
    const Search found = lineSearch(here_.gradient);
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
    const double near = kNear * objective_.elastic().h(), solved = settings_.tolerance * here_.forceScale + here_.noise;
    const auto add = [&](std::span<const Vec3> gradient) -> Side& {
        if (sides_.size() == sideCount_) sides_.emplace_back();
        sides_[sideCount_].gradient.assign(gradient.begin(), gradient.end());
        return sides_[sideCount_++];
    };
    sideCount_ = 0;
    add(here_.gradient).direction = direction_;
    double farthest = 0;
    while (sideCount_ < kMaxMeans) {
        farthest = std::max(farthest, farthestMove(here_.x, there_.x));
        Side& beyond = add(there_.gradient);
        beyond.direction.resize(here_.x.size());
        objective_.evaluate(here_), makeTangent();  // which belongs to it again
        if (solve(beyond.gradient, beyond.direction, forcingTerm()) == LinearStatus::negativeCurvature) return false;
        combineSides();
        const double least = freeNorm(combined_);
        // Bent, not creased: nothing but a shorter step.
        if (!(dot(direction_, combined_) > 0 && least <= here_.norm)) {
            reach_ = kCloser * farthest;
            direction_ = sides_[0].direction;
            if (lineSearch(here_.gradient) == Search::accepted) return true;
            break;
        }
        if (least <= solved) {
            if (farthest <= near) crease_ = least;
            reach_ = near;  // or look again, with sides as near as that
            if (made_ != NewtonTangent::exact) objective_.evaluate(here_);
            return true;
        }
        const Search found = lineSearch(combined_);
        if (found == Search::accepted)
            reach_ = std::max(near, std::min(reach_, kMoves * farthestMove(here_.x, there_.x)));
        if (found != Search::crease) return found == Search::accepted;
    }
    objective_.evaluate(here_);
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
    const Eigen::VectorXd weight = shortestMean(products);
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
    const std::span<const std::uint8_t> fixed = objective_.fixed();
    return std::sqrt(
        nodeSum<double>(gradient.size(), [&](std::size_t i) { return fixed[i] ? 0 : gradient[i].squaredNorm(); }));
}

/// Looks along -direction_, which belongs to the gradient, for a point that is lower.
BackwardEuler::Newton::Search BackwardEuler::Newton::lineSearch(std::span<const Vec3> gradient)
{
    constexpr int kMaxHalvings = 20;
    constexpr double kArmijo = 1e-4;
    const double slope = dot(direction_, gradient);  // the direction is 0 at fixed nodes
    double step = 1;
    for (int halving = 0; slope > 0 && halving <= kMaxHalvings; ++halving, step *= 0.5) {
        eachNode<double>(here_.x.size(), [&](std::size_t i) { there_.x[i] = here_.x[i] - step * direction_[i]; });
        objective_.evaluate(there_);
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
    objective_.evaluate(here_);  // the tangent belongs to it again
    return Search::failed;
}

void BackwardEuler::Newton::finish(State& state)
{
    const double dt = objective_.dt();
    const bool moves = std::isfinite(dt);
    const Boundary& boundary = objective_.boundary();
    const std::span<const double> mass = objective_.elastic().mass();
    // At a crease what balances the other forces is a mean of the elastic ones on its sides.
    if (moves)
        report_.elasticWork = objective_.elasticWork(here_.x, crease_ >= 0 ? combined_ : here_.gradient, state.x);
    objective_.balanceMomentum(here_);
    report_.residual = crease_ >= 0 ? relative(here_, crease_) : relative(here_);
    report_.minResidual = std::min(report_.minResidual, report_.residual);
    if (report_.status == StepStatus::capped) report_.worstNode = objective_.worstNode(here_);
    report_.creases = crease_ >= 0;
    report_.couplings = objective_.couplings().size();
    report_.elasticEnergy = here_.elastic;
    report_.inertialLoss = nodeSum<double>(here_.x.size(), [&](std::size_t i) {
        report_.reaction[i] = boundary.fixed[i] ? here_.gradient[i] : Vec3::Zero();
        const Vec3 before = state.v[i];
        if (moves) state.v[i] = (here_.x[i] - state.x[i]) / dt;
        state.x[i] = here_.x[i];
        return 0.5 * mass[i] * (state.v[i] - before).squaredNorm();
    });
}

const StepReport& BackwardEuler::Newton::run(State& state)
{
    // Of a cell: strains for which the linearised body is a better start than one at rest.
    constexpr double kJump = 0.1;
    constexpr double kLoose = 0.03;    // how well to solve for what is brought up to date then
    constexpr int kMostRefreshes = 3;  // what alternates between two states is left in one of them
    if (objective_.jump() > kJump * objective_.elastic().h()) {
        lift();
    } else {
        objective_.hold(here_);
        objective_.evaluate(here_);
    }
    report_.minResidual = relative(here_);
    most_ = settings_.iterations;
    const double loose = std::max(kLoose, settings_.tolerance);
    for (double tolerance : {loose, settings_.tolerance}) {
        descendToRest(tolerance);
        for (int n = 0; n < kMostRefreshes && report_.status == StepStatus::converged; ++n) {
            if (!objective_.refresh(here_.x)) break;
            objective_.evaluate(here_);
            crease_ = -1;
            most_ = report_.newtonIterations + settings_.iterations;
            descendToRest(tolerance);
        }
    }
    finish(state);
    return report_;
}

void BackwardEuler::Newton::descendToRest(double tolerance)
{
    while (report_.status == StepStatus::converged && !isConverged(here_, tolerance) && crease_ < 0) {
        if (report_.newtonIterations >= most_ || !improve()) {
            report_.status = StepStatus::capped;
            break;
        }
        ++report_.newtonIterations;
        objective_.prune(here_.x);
        report_.minResidual = std::min(report_.minResidual, relative(here_));
    }
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
