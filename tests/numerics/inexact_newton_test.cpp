// Newton's method with linear systems solved only as far as the step needs: what it reaches, and what that saves.
#include <vdbfrac/lab/samples/loads.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <numbers>

using namespace vdbfrac;
using solver::LinearMethod;

namespace {

/// A bar held at x = 0 whose other end is bent down and twisted, faster than it can follow.
struct BentAndTwisted {
    static constexpr int kCells = 16;
    static constexpr double dt = .02, kTurn = .35;  // s; rad a step
    lab::Block block{{kCells, 5, 6}, 1. / kCells};
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .4, 1000));
    solver::Boundary boundary = lab::clamped(block, [](Coord c) { return c.x == 0 || c.x == kCells; });
    solver::State state = lab::atRest(block);

    void moveEnd(int step)
    {
        const Mat3 bend = Eigen::AngleAxisd(step * kTurn / 2, Vec3::UnitY()).toRotationMatrix();
        const Mat3 twist = Eigen::AngleAxisd(step * kTurn, Vec3::UnitX()).toRotationMatrix();
        const Vec3 center(1, 2.5 * block.h, 3 * block.h), moved = center - step * Vec3(.02, 0, .05);
        for (std::size_t i = 0; i < block.nodes.size(); ++i) {
            if (block.nodes[i].x != kCells) continue;
            boundary.target[i] = moved + bend * twist * (block.h * block.nodes[i].toVec() - center);
        }
    }
    solver::System system() const { return {{}, boundary}; }
};

solver::NewtonSettings settingsOf(double tolerance, LinearMethod method = LinearMethod::jacobi)
{
    solver::NewtonSettings settings;
    settings.tolerance = tolerance;
    settings.linearMethod = method;
    settings.iterations = 60;
    return settings;
}

constexpr LinearMethod kMethods[] = {LinearMethod::jacobi, LinearMethod::multigrid, LinearMethod::direct};

TEST(InexactNewton, ReachesTheToleranceOfOneCheckerWithEveryMethod)
{
    constexpr double kRounding = 1e-9;  // of the tolerance: momentum of parts that hang free is not touched here
    for (LinearMethod method : kMethods)
        for (double tolerance : {1e-2, 1e-4, 1e-6}) {
            BentAndTwisted bar;
            solver::BackwardEuler stepper(bar.elastic, settingsOf(tolerance, method));
            solver::BackwardEuler checker(bar.elastic, {});  // of other settings
            for (int n = 1; n <= 4; ++n) {
                bar.moveEnd(n);
                const solver::State before = bar.state;
                const auto& report = stepper.step(bar.state, bar.dt, bar.system());
                EXPECT_EQ(report.status, solver::StepStatus::converged);
                EXPECT_GT(report.newtonIterations, 0);
                const double residual = checker.residual(before, bar.dt, bar.system(), bar.state.x);
                EXPECT_LE(residual, tolerance) << int(method) << " step " << n;
                EXPECT_NEAR(report.residual, residual, kRounding * tolerance);
            }
        }
}

TEST(InexactNewton, CheckerSeesWhatASmallerStepOfNewtonLeaves)
{
    BentAndTwisted bar;
    bar.moveEnd(1);
    const solver::State before = bar.state;
    std::vector<Vec3> start = before.x;  // free nodes where they would drift to, held ones at their targets
    for (std::size_t i = 0; i < start.size(); ++i)
        if (bar.boundary.fixed[i]) start[i] = bar.boundary.target[i];
    solver::BackwardEuler stepper(bar.elastic, settingsOf(1e-6));
    const double first = stepper.residual(before, bar.dt, bar.system(), start);
    (void)stepper.step(bar.state, bar.dt, bar.system());
    std::vector<Vec3> half = start;
    for (std::size_t i = 0; i < half.size(); ++i) half[i] = (start[i] + bar.state.x[i]) / 2;
    const double middle = stepper.residual(before, bar.dt, bar.system(), half);
    const double last = stepper.residual(before, bar.dt, bar.system(), bar.state.x);
    EXPECT_GT(first, .1);
    EXPECT_LT(middle, first);
    EXPECT_LT(last, 1e-6);
}

/// Positions after some steps, each solved to rounding.
std::vector<Vec3> endOf(LinearMethod method)
{
    BentAndTwisted bar;
    solver::NewtonSettings settings = settingsOf(1e-12, method);
    settings.linearTolerance = 1e-9;
    settings.linearIterations = 50000;
    solver::BackwardEuler stepper(bar.elastic, settings);
    for (int n = 1; n <= 4; ++n) {
        bar.moveEnd(n);
        EXPECT_EQ(stepper.step(bar.state, bar.dt, bar.system()).status, solver::StepStatus::converged) << int(method);
    }
    return bar.state.x;
}

TEST(InexactNewton, MethodsEndInTheSameState)
{
    // Forces balance to 1e-12 of the largest; some 1e3 is the condition of the system of a step.
    constexpr double kSame = 1e-9;  // of the displacement
    const std::vector<Vec3> direct = endOf(LinearMethod::direct);
    const std::vector<Vec3> rest = BentAndTwisted().state.x;
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        const std::vector<Vec3> x = endOf(method);
        double error = 0, size = 0;
        for (std::size_t i = 0; i < x.size(); ++i)
            error += (x[i] - direct[i]).squaredNorm(), size += (direct[i] - rest[i]).squaredNorm();
        std::printf("method %d differs from direct by %.1e\n", int(method), std::sqrt(error / size));
        EXPECT_LE(std::sqrt(error), kSame * std::sqrt(size)) << int(method);
    }
}

/// Fewest linear iterations that bring the residual of a step to `tolerance` with every system solved to 1e-6: Newton's
/// method stopped after one iteration, then after two, and so on.
int iterationsSolvedTightly(const BentAndTwisted& bar, double tolerance, LinearMethod method)
{
    solver::NewtonSettings settings = settingsOf(0, method);  // a tolerance of 0 loosens nothing
    settings.linearTolerance = 1e-6;
    for (settings.iterations = 1; settings.iterations < 30; ++settings.iterations) {
        solver::State state = bar.state;
        solver::BackwardEuler stepper(bar.elastic, settings);
        const auto& report = stepper.step(state, bar.dt, bar.system());
        if (report.residual <= tolerance) return report.linearIterations;
    }
    ADD_FAILURE() << "not reached";
    return 0;
}

TEST(InexactNewton, LooseSystemsSaveLinearIterations)
{
    constexpr double kTolerance = 1e-2, kMinGain = 1.5;
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        BentAndTwisted bar;
        solver::BackwardEuler stepper(bar.elastic, settingsOf(kTolerance, method));
        int loose = 0, tight = 0, looseNewton = 0;
        for (int n = 1; n <= 4; ++n) {
            bar.moveEnd(n);
            tight += iterationsSolvedTightly(bar, kTolerance, method);
            const auto& report = stepper.step(bar.state, bar.dt, bar.system());
            EXPECT_LE(report.residual, kTolerance);
            loose += report.linearIterations;
            looseNewton += report.newtonIterations;
        }
        std::printf("method %d: %d linear iterations in %d of Newton, solved to 1e-6: %d\n", int(method), loose,
                    looseNewton, tight);
        EXPECT_GE(tight, kMinGain * loose) << int(method);
    }
}

/// Phi of a step without potentials [J] and its gradient at free nodes [N], added up anew.
struct Objective {
    const solver::ElasticOperator& elastic;
    const solver::Boundary& boundary;
    solver::State start;
    double dt;

    double operator()(std::span<const Vec3> x, std::vector<Vec3>& gradient) const
    {
        gradient.assign(x.size(), Vec3::Zero());
        double phi = elastic.evaluate(x, gradient, nullptr);
        for (std::size_t i = 0; i < x.size(); ++i) {
            const Vec3 moved = x[i] - start.x[i] - dt * start.v[i];
            phi += 0.5 * elastic.mass()[i] / (dt * dt) * moved.squaredNorm() - boundary.force[i].dot(x[i]);
            gradient[i] += elastic.mass()[i] / (dt * dt) * moved - boundary.force[i];
            if (boundary.fixed[i]) gradient[i].setZero();
        }
        return phi;
    }
};

/// With linear strain Phi is quadratic: the gradient after one iteration of Newton is the residual of its linear
/// system. In the norm that conjugate gradients with block-Jacobi measure, it is what docs/physics.md says of the
/// gradient before: linear_tolerance, or a fifth of what would meet newton_tolerance, whichever is looser, and no more
/// than a tenth.
TEST(InexactNewton, LinearSystemsAreSolvedAsFarAsTheToleranceSays)
{
    constexpr double kSingle = 1e-3;  // relative: residuals that single precision carries along
    struct Tolerances {
        double newton, linear;
    };
    for (const auto precision : {solver::LinearPrecision::mixed, solver::LinearPrecision::doubles})
        for (const Tolerances& asked :
             std::initializer_list<Tolerances>{{1e-3, 1e-2}, {1e-3, 1e-4}, {0, 1e-6}, {0.1, 1e-4}, {0.4, 1e-4}}) {
            const lab::Block block({12, 6, 6}, 0.1);
            const solver::Elasticity linear{solver::Volumetric::cell, solver::Strain::linear};
            const auto elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000), linear);
            solver::Boundary boundary = lab::clamped(block, [](Coord c) { return c.x == 0; });
            for (std::size_t i = 0; i < boundary.force.size(); ++i)
                if (block.nodes[i].x == 12) boundary.force[i] = Vec3(1, 0, -2);
            solver::State state = lab::atRest(block);
            const Objective phi{elastic, boundary, state, 0.1};
            solver::NewtonSettings settings = settingsOf(asked.newton);
            settings.linearTolerance = asked.linear;
            settings.linearPrecision = precision;
            settings.iterations = 1;

            std::vector<Vec3> before, after;
            phi(state.x, before);
            solver::Tangent tangent;
            elastic.evaluate(state.x, {}, &tangent);
            const auto diagonal = lab::diagonalBlocks(elastic, tangent);
            const auto size = [&](const std::vector<Vec3>& r) {
                double sum = 0;
                for (std::size_t i = 0; i < r.size(); ++i) {
                    const Mat3 D = diagonal[i] + elastic.mass()[i] / (phi.dt * phi.dt) * Mat3::Identity();
                    sum += r[i].dot(D.inverse() * r[i]);
                }
                return std::sqrt(sum);
            };
            double norm = 0, outer = 0;
            for (std::size_t i = 0; i < before.size(); ++i)
                norm += before[i].squaredNorm(), outer += boundary.force[i].squaredNorm();
            ASSERT_NEAR(norm, outer, 1e-9 * outer);  // nothing else acts at the start: it is the largest of the forces
            solver::BackwardEuler stepper(elastic, settings);
            EXPECT_EQ(stepper.step(state, phi.dt, {{}, boundary}).newtonIterations, 1);
            phi(state.x, after);
            const double wanted = std::max(asked.linear, std::min(0.2 * asked.newton, 0.1)),
                         reached = size(after) / size(before);
            std::printf("newton %g, linear %g: solved to %.3e, to be %.1e\n", asked.newton, asked.linear, reached,
                        wanted);
            EXPECT_LE(reached, wanted * (1 + kSingle));
        }
}

/// From starts that are scrambled and squeezed or pulled far, where whole steps of Newton overshoot: after k
/// iterations, then k + 1.
TEST(LineSearch, NoIterationOfNewtonRaisesTheEnergyOfTheStep)
{
    using solver::NewtonTangent;
    using solver::Strain;
    constexpr double kRounding = 1e-12;  // of the energy at the start
    constexpr int kMaxIterations = 30;
    struct Start {
        Strain strain;
        NewtonTangent tangent;
        Vec3 stretch;
        double shake, dt;  // lattice spacings, s
    };
    const Vec3 squeezed(0.3, 0.4, 0.5), pulled(2.5, 0.3, 0.3);
    const Start starts[] = {{Strain::corotational, NewtonTangent::exact, pulled, 3, 10},
                            {Strain::corotational, NewtonTangent::exact, squeezed, 3, 0.05},
                            {Strain::green, NewtonTangent::exact, squeezed, 0.7, 10},
                            {Strain::green, NewtonTangent::projected, squeezed, 0.7, 10},
                            {Strain::green, NewtonTangent::warped, pulled, 0.7, 0.05}};
    for (const Start& from : starts) {
        const lab::Block block({5, 4, 4}, 0.1);
        const auto elastic =
            lab::elasticOperator(block, solver::makeMaterial(1e5, .4, 1000), {solver::Volumetric::cell, from.strain});
        const solver::Boundary boundary = lab::clamped(block, [](Coord c) { return c.x == 0; });
        solver::State start = lab::shaken(block, from.shake, 0, 11);
        for (Vec3& x : start.x) x = from.stretch.cwiseProduct(x);
        const Objective phi{elastic, boundary, start, from.dt};
        std::vector<Vec3> gradient, held = start.x;
        for (std::size_t i = 0; i < held.size(); ++i)
            if (boundary.fixed[i]) held[i] = boundary.target[i];
        const double first = phi(held, gradient);
        double before = first;
        solver::NewtonSettings settings = settingsOf(1e-6);
        settings.tangent = from.tangent;
        solver::StepReport report;
        for (settings.iterations = 1; settings.iterations <= kMaxIterations; ++settings.iterations) {
            solver::State state = start;
            report = solver::stepBackwardEuler(elastic, state, from.dt, {{}, boundary}, settings);
            const double now = phi(state.x, gradient);
            EXPECT_LE(now, before + kRounding * first)
                << "iteration " << settings.iterations << ", tangent " << int(from.tangent);
            before = now;
            if (report.status == solver::StepStatus::converged) break;
        }
        std::printf("%d iterations, %d halvings: %.4g J -> %.4g J\n", report.newtonIterations, report.lineSearchSteps,
                    first, before);
        EXPECT_GT(report.lineSearchSteps, 0) << "the start shows nothing";
    }
}

}  // namespace
