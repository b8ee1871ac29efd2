#include <vdbfrac/solver/backward_euler.h>

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/conjugate_gradient.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

namespace {

/// Phi at one x, with the sizes that tell how small its gradient has to be.
struct Point {
    double phi = 0;         ///< J
    double elastic = 0;     ///< J
    double phiNoise = 0;    ///< J: what rounding alone can change phi by
    std::vector<Vec3> gradient;
    double norm = 0;        ///< N: of the gradient at free nodes
    double forceScale = 0;  ///< N: largest of inertia, elastic and outer force
    double noise = 0;       ///< N: what rounding alone can leave of the gradient
};

class Newton {
public:
    Newton(State& state, double dt, const System& system, const NewtonSettings& settings)
        : state_(state), dt_(dt), system_(system), settings_(settings), nodes_(state.x.size()), predicted_(nodes_)
    {
        inertia_ = 1 / (dt * dt);
        const double drift = std::isfinite(dt) ? dt : 0;
        for (std::size_t i = 0; i < nodes_; ++i) predicted_[i] = state.x[i] + drift * state.v[i];
    }

    StepReport run();

private:
    Point evaluate(std::span<const Vec3> x);
    bool small(const Point& point) const
    {
        return point.norm <= settings_.tolerance * point.forceScale + point.noise;
    }
    void projectTangent();
    bool improve(Point& point, std::vector<Vec3>& x);
    LinearStatus solve(const Point& point, std::span<Vec3> direction);
    std::vector<Mat3> inverseDiagonal() const;
    bool search(Point& point, std::vector<Vec3>& x, std::span<const Vec3> direction);
    void balanceMomentum(const Point& point, std::vector<Vec3>& x) const;
    void finish(const Point& point, std::vector<Vec3>& x);

    State& state_;
    double dt_, inertia_ = 0;
    const System& system_;
    const NewtonSettings& settings_;
    std::size_t nodes_;
    std::vector<Vec3> predicted_;
    Tangent tangent_;
    StepReport report_;
};

/// Norm over the free nodes of term(i), a vector or a number.
template <class Term>
double freeNorm(const Boundary& boundary, const Term& term)
{
    return std::sqrt(orderedSum(boundary.fixed.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i)
            if (!boundary.fixed[i]) sum += term(i);
        return sum;
    }));
}

Point Newton::evaluate(std::span<const Vec3> x)
{
    constexpr double kRounding = 2e-15;  // of the magnitudes a nodal force is added from: some ten roundings of a double
    constexpr double kPhiRounding = 1e-14;  // of the magnitudes phi is added from
    Point p;
    p.gradient.assign(nodes_, Vec3::Zero());
    p.elastic = system_.elastic.evaluate(x, p.gradient, &tangent_);
    p.forceScale = freeNorm(system_.boundary, [&](std::size_t i) { return p.gradient[i].squaredNorm(); });
    p.phi = p.elastic;
    double phiScale = std::abs(p.elastic);

    std::vector<Vec3> outer(nodes_, Vec3::Zero());
    for (Potential* potential : system_.potentials) {
        const double value = potential->evaluate(x, outer);
        p.phi += value;
        phiScale += std::abs(value);
    }
    const std::span<const double> mass = system_.elastic.mass(), stiffness = system_.elastic.stiffness();
    const auto& force = system_.boundary.force;
    const auto inertiaOf = [&](std::size_t i) -> Vec3 { return mass[i] * inertia_ * (x[i] - predicted_[i]); };
    const double kinetic = orderedSum(nodes_, kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += 0.5 * inertiaOf(i).dot(x[i] - predicted_[i]);
        return sum;
    });
    const double work = dot(force, x);
    p.phi += kinetic - work;
    phiScale += kinetic + std::abs(work);
    parallelChunks(nodes_, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            outer[i] -= force[i];
            p.gradient[i] += outer[i] + inertiaOf(i);
        }
    });
    const auto& b = system_.boundary;
    p.norm = freeNorm(b, [&](std::size_t i) { return p.gradient[i].squaredNorm(); });
    p.forceScale = std::max({p.forceScale, freeNorm(b, [&](std::size_t i) { return outer[i].squaredNorm(); }),
                             freeNorm(b, [&](std::size_t i) { return inertiaOf(i).squaredNorm(); })});
    p.noise = kRounding * freeNorm(b, [&](std::size_t i) {
        const double k = stiffness[i] + mass[i] * inertia_;
        return k * k * x[i].squaredNorm();
    });
    // F is rounded by |x| / h units, so a small strain energy K e^2 is off by K e times that.
    const double stretched = orderedSum(nodes_, kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += stiffness[i] * x[i].squaredNorm();
        return sum;
    });
    p.phiNoise = kPhiRounding * phiScale + kRounding * std::sqrt(stretched * std::abs(p.elastic));
    return p;
}

std::vector<Mat3> Newton::inverseDiagonal() const
{
    std::vector<Mat3> blocks(nodes_);
    const std::span<const double> mass = system_.elastic.mass(), stiffness = system_.elastic.stiffness();
    for (std::size_t i = 0; i < nodes_; ++i) blocks[i] = mass[i] * inertia_ * Mat3::Identity();
    system_.elastic.addDiagonal(tangent_, blocks);
    for (Potential* potential : system_.potentials) potential->addDiagonal(blocks);
    parallelChunks(nodes_, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Eigen::LLT<Mat3> factor(blocks[i]);
            // An indefinite block would spoil the preconditioner; any positive scale keeps it definite.
            blocks[i] = factor.info() == Eigen::Success ? Mat3(factor.solve(Mat3::Identity()))
                                                        : Mat3(Mat3::Identity() / (stiffness[i] + mass[i] * inertia_));
        }
    });
    return blocks;
}

LinearStatus Newton::solve(const Point& point, std::span<Vec3> direction)
{
    const std::vector<Mat3> inverse = inverseDiagonal();
    const std::span<const double> mass = system_.elastic.mass();
    LinearSystem linear;
    linear.inverseDiagonal = inverse;
    linear.fixed = system_.boundary.fixed;
    linear.product = [&](std::span<const Vec3> u, std::span<Vec3> out) {
        parallelChunks(nodes_, kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) out[i] = mass[i] * inertia_ * u[i];
        });
        system_.elastic.addProduct(tangent_, u, out);
        for (Potential* potential : system_.potentials) potential->addProduct(u, out);
    };
    const LinearReport r = solveConjugateGradient(linear, point.gradient, direction,
                                                  {settings_.linearTolerance, settings_.linearIterations});
    report_.linearIterations += r.iterations;
    return r.status;
}

void Newton::projectTangent()
{
    system_.elastic.project(tangent_);
    ++report_.projections;
}

/// One Newton iteration: the exact tangent first; projected only where it shows negative curvature or does not descend.
/// A capped linear solve still gives a direction of descent; whether it was good enough shows in the Newton residual.
bool Newton::improve(Point& point, std::vector<Vec3>& x)
{
    std::vector<Vec3> direction(nodes_);
    if (solve(point, direction) != LinearStatus::negativeCurvature && search(point, x, direction)) return true;
    projectTangent();
    return solve(point, direction) != LinearStatus::negativeCurvature && search(point, x, direction);
}

bool Newton::search(Point& point, std::vector<Vec3>& x, std::span<const Vec3> direction)
{
    constexpr int kMostHalvings = 20;
    constexpr double kArmijo = 1e-4;
    double slope = 0;
    for (std::size_t i = 0; i < nodes_; ++i)
        if (!system_.boundary.fixed[i]) slope += direction[i].dot(point.gradient[i]);
    std::vector<Vec3> trial(nodes_);
    double step = 1;
    for (int halving = 0; slope > 0 && halving <= kMostHalvings; ++halving, step *= 0.5) {
        for (std::size_t i = 0; i < nodes_; ++i) trial[i] = x[i] - step * direction[i];
        Point there = evaluate(trial);
        const double change = there.phi - point.phi, noise = point.phiNoise + there.phiNoise;
        const bool descends = change <= -kArmijo * step * slope;
        const bool level = std::abs(change) <= noise && there.norm <= point.norm * (1 + 1e-9) + there.noise;
        if (descends || level) {
            point = std::move(there);
            x.swap(trial);
            return true;
        }
        ++report_.lineSearchSteps;
    }
    (void)evaluate(x);  // the tangent belongs to x again
    return false;
}

/// Shifts each part without fixed nodes by what zeroes its summed gradient: internal forces cancel in the sum and do not
/// change under a shift, so only inertia answers. Sums run over nodes in order.
void Newton::balanceMomentum(const Point& point, std::vector<Vec3>& x) const
{
    struct Part {
        Vec3 force = Vec3::Zero();
        double inertia = 0;
        bool held = false;
    };
    if (!(inertia_ > 0)) return;
    const auto& labels = system_.boundary.part;
    const auto mass = system_.elastic.mass();
    std::vector<Part> parts(labels.empty() ? 1 : *std::max_element(labels.begin(), labels.end()) + 1);
    for (std::size_t i = 0; i < nodes_; ++i) {
        Part& part = parts[labels.empty() ? 0 : labels[i]];
        part.force += point.gradient[i];
        part.inertia += mass[i] * inertia_;
        part.held = part.held || system_.boundary.fixed[i];
    }
    for (std::size_t i = 0; i < nodes_; ++i) {
        const Part& part = parts[labels.empty() ? 0 : labels[i]];
        if (!part.held && part.inertia > 0) x[i] -= part.force / part.inertia;
    }
}

void Newton::finish(const Point& point, std::vector<Vec3>& x)
{
    balanceMomentum(point, x);
    const double scale = std::max(point.forceScale, point.noise);
    report_.residual = scale > 0 ? point.norm / scale : 0;
    report_.elasticEnergy = point.elastic;
    report_.reaction.assign(nodes_, Vec3::Zero());
    for (std::size_t i = 0; i < nodes_; ++i) {
        if (system_.boundary.fixed[i]) report_.reaction[i] = point.gradient[i];
        if (std::isfinite(dt_)) state_.v[i] = (x[i] - state_.x[i]) / dt_;
    }
    state_.x.swap(x);
}

StepReport Newton::run()
{
    std::vector<Vec3> x = predicted_;
    for (std::size_t i = 0; i < nodes_; ++i)
        if (system_.boundary.fixed[i]) x[i] = system_.boundary.target[i];
    Point point = evaluate(x);
    while (!small(point)) {
        if (report_.newtonIterations == settings_.iterations || !improve(point, x)) {
            report_.status = StepStatus::capped;
            break;
        }
        ++report_.newtonIterations;
    }
    finish(point, x);
    return report_;
}

}  // namespace

StepReport stepBackwardEuler(State& state, double dt, const System& system, const NewtonSettings& settings)
{
    for (Potential* potential : system.potentials) potential->begin({state.x, state.v, dt, system.elastic});
    return Newton(state, dt, system, settings).run();
}

}  // namespace vdbfrac::solver
