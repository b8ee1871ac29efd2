// Starts that no simulation should meet, and all of them do.
#include "cases.h"

#include <vdbfrac/lab/samples/loads.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kRecovered = 1e-8;  // of the initial energy
constexpr unsigned kSeeds = 20;

struct Recovery {
    double left = 0;  ///< energy, of that at the start
    int newtonIterations = 0;
};

/// Relaxes a free block from `x` in long steps, each with its velocities taken away: only the shape matters.
Recovery relax(const Block& block, const std::vector<Vec3>& x, double nu)
{
    const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    const solver::Boundary boundary = freeBoundary(block.nodes.size());
    solver::State state{x, std::vector<Vec3>(x.size(), Vec3::Zero())};
    const double start = elastic.evaluate(x, {}, nullptr);
    solver::NewtonSettings settings;
    settings.iterations = 60;
    Recovery recovery{1, 0};
    for (int n = 0; n < 40 && !(recovery.left <= kRecovered); ++n) {
        const auto report = solver::stepBackwardEuler(elastic, state, 0.1, {{}, boundary}, settings);
        recovery.left = report.elasticEnergy / start;
        recovery.newtonIterations += report.newtonIterations;
        for (Vec3& v : state.v) v.setZero();
    }
    return recovery;
}

/// Seeds of 20 from which a block of 4^3 cells of 0.1 m recovers; `place(X, random)` gives the start.
int recovered(double nu, const std::function<Vec3(const Vec3&, std::mt19937&)>& place)
{
    const Block block({4, 4, 4}, 0.1);
    int count = 0;
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
        std::mt19937 random(seed);
        std::vector<Vec3> x = block.restPositions();
        for (Vec3& p : x) p = place(p, random);
        count += relax(block, x, nu).left <= kRecovered;
    }
    return count;
}

constexpr double kStep = .01;  // s
constexpr int kCells = 4;      // of a block, each way

/// Newton iterations that count for a step.
int iterationsOf(const solver::StepReport& report)
{
    constexpr int kCapped = 1000;
    return report.status == solver::StepStatus::capped ? kCapped : report.newtonIterations;
}

/// Most Newton iterations of a step while a block that was brought to `factor` times its length is let go.
int iterationsFromLength(double nu, double factor)
{
    constexpr int kSteps = 100;
    const Block block({kCells, kCells, kCells}, 0.1);
    const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    const solver::Boundary boundary = freeBoundary(block.nodes.size());
    solver::BackwardEuler stepper(elastic, {});
    solver::State state = atRest(block);
    for (Vec3& x : state.x) x.x() *= factor;
    int most = 0;
    for (int n = 0; n < kSteps; ++n) most = std::max(most, iterationsOf(stepper.step(state, kStep, {{}, boundary})));
    return most;
}

/// Most Newton iterations of a step while the ends of a block go from their distance to `factor` times it, by half a
/// cell in each step. The sides are free.
int iterationsToLength(double nu, double factor)
{
    constexpr double kMove = 0.5;  // cells
    const int steps = int(std::ceil(kCells * std::abs(factor - 1) / kMove));
    const Block block({kCells, kCells, kCells}, 0.1);
    const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    solver::Boundary boundary = clamped(block, [](Coord c) { return c.x == 0 || c.x == kCells; });
    solver::BackwardEuler stepper(elastic, {});
    solver::State state = atRest(block);
    int most = 0;
    for (int n = 1; n <= steps; ++n) {
        const double length = 1 + (factor - 1) * n / steps;
        for (std::size_t i = 0; i < block.nodes.size(); ++i)
            boundary.target[i].x() = length * block.h * block.nodes[i].x;
        most = std::max(most, iterationsOf(stepper.step(state, kStep, {{}, boundary})));
    }
    return most;
}

}  // namespace

Measurements mirroredStart(Extent)
{
    constexpr double kMin = 19;
    Measurements all;
    for (double nu : kPoissonRatios)
        all.push_back(atLeast(at(nu) + "starts of 20 that recover",
                              recovered(nu,
                                        [](const Vec3& X, std::mt19937& random) {
                                            return Vec3(Vec3(-X.x(), X.y(), X.z()) + randomVec(random, 0.005));
                                        }),
                              kMin));
    return all;
}

Measurements scrambledStart(Extent)
{
    Measurements all;
    for (double nu : {.3, .45, .49, .499})
        all.push_back(atLeast(at(nu) + "starts of 20 that recover",
                              recovered(nu, [](const Vec3&, std::mt19937& random) { return randomVec(random, 0.2); }),
                              kSeeds));
    return all;
}

Measurements collapsedStart(Extent)
{
    constexpr double kMaxIterations = 60;
    const Vec3 kept[] = {{1, 1, 0}, {0, 1, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}};  // three planes, a line, a point
    const Block block({3, 3, 3}, 0.1);
    Measurements all;
    for (double nu : kPoissonRatios) {
        int count = 0, most = 0;
        for (const Vec3& keep : kept) {
            std::vector<Vec3> x = block.restPositions();
            for (Vec3& p : x) p = p.cwiseProduct(keep).eval();
            const Recovery recovery = relax(block, x, nu);
            count += recovery.left <= kRecovered;
            most = std::max(most, recovery.newtonIterations);
        }
        all.push_back(atLeast(at(nu) + "starts of 5 that recover", count, 5));
        all.push_back(atMost(at(nu) + "most Newton iterations", most, kMaxIterations));
    }
    return all;
}

Measurements stretchAndSquash(Extent)
{
    constexpr double kMax = 5;
    // A bar with free sides gets thinner by nu times the strain, to nothing at the strain 1 / nu: beyond, this material
    // has no state that is not inverted.
    constexpr double kOfThinnest = .5;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const auto add = [&](const char* what, int iterations) {
            all.push_back(atMost(at(nu) + "Newton iterations of a step, " + what, iterations, kMax));
        };
        add("pulled to the strain 1 / (2 nu)", iterationsToLength(nu, 1 + kOfThinnest / nu));
        add("pulled to 10 times the length", iterationsToLength(nu, 10));
        add("pressed to 0.01 of the length", iterationsToLength(nu, .01));
        add("let go from 10 times the length", iterationsFromLength(nu, 10));
        add("let go from 0.01 of the length", iterationsFromLength(nu, .01));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
