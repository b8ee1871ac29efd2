// Starts that no simulation should meet, and all of them do.
#include "cases.h"
#include "loads.h"

#include <algorithm>
#include <functional>

namespace vdbfrac::tools::verify {

namespace {

constexpr double kRecovered = 1e-8;  // of the initial energy
constexpr unsigned kSeeds = 20;

struct Recovery {
    double left = 0;  ///< energy, of that at the start
    int newtonIterations = 0;
};

/// Relaxes a free block from `x` in long steps, each with its velocities taken away: only the shape matters.
Recovery relax(const test::Block& block, const std::vector<Vec3>& x, double nu)
{
    const auto elastic = test::elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    const solver::Boundary boundary = test::freeBoundary(block.nodes.size());
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
    const test::Block block({4, 4, 4}, 0.1);
    int count = 0;
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
        std::mt19937 random(seed);
        std::vector<Vec3> x = block.restPositions();
        for (Vec3& p : x) p = place(p, random);
        count += relax(block, x, nu).left <= kRecovered;
    }
    return count;
}

/// Most Newton iterations of a step while the ends of a block go from their distance to `factor` times it, in 24 steps
/// of 1/24 s. A step that is capped counts as 1000.
int iterationsToLength(double nu, double factor)
{
    constexpr int kSteps = 24, kCells = 4;
    constexpr double kStep = 1. / 24;
    const test::Block block({kCells, kCells, kCells}, 0.1);
    const auto elastic = test::elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    solver::Boundary boundary = test::clamped(block, [](Coord c) { return c.x == 0 || c.x == kCells; });
    solver::BackwardEuler stepper(elastic, {});
    solver::State state = test::atRest(block);
    int most = 0;
    for (int n = 1; n <= kSteps; ++n) {
        const double length = 1 + (factor - 1) * n / kSteps;
        for (std::size_t i = 0; i < block.nodes.size(); ++i)
            boundary.target[i].x() = length * block.h * block.nodes[i].x;
        const auto& report = stepper.step(state, kStep, {{}, boundary});
        most = std::max(most, report.status == solver::StepStatus::capped ? 1000 : report.newtonIterations);
    }
    return most;
}

}  // namespace

Measurements mirroredStart(Extent)
{
    constexpr double kLeast = 19;
    Measurements all;
    for (double nu : kPoissonRatios)
        all.push_back(atLeast(at(nu) + "starts of 20 that recover",
                              recovered(nu,
                                        [](const Vec3& X, std::mt19937& random) {
                                            return Vec3(Vec3(-X.x(), X.y(), X.z()) + test::randomVec(random, 0.005));
                                        }),
                              kLeast));
    return all;
}

Measurements scrambledStart(Extent)
{
    Measurements all;
    for (double nu : {.3, .45, .49, .499})
        all.push_back(atLeast(
            at(nu) + "starts of 20 that recover",
            recovered(nu, [](const Vec3&, std::mt19937& random) { return test::randomVec(random, 0.2); }), kSeeds));
    return all;
}

Measurements collapsedStart(Extent)
{
    constexpr double kMostIterations = 60;
    const Vec3 kept[] = {{1, 1, 0}, {0, 1, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0}};  // three planes, a line, a point
    const test::Block block({3, 3, 3}, 0.1);
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
        all.push_back(atMost(at(nu) + "most Newton iterations", most, kMostIterations));
    }
    return all;
}

Measurements stretchAndSquash(Extent)
{
    constexpr double kMost = 5;
    Measurements all;
    for (double nu : kPoissonRatios) {
        all.push_back(
            atMost(at(nu) + "Newton iterations of a step, to 10 times the length", iterationsToLength(nu, 10), kMost));
        all.push_back(
            atMost(at(nu) + "Newton iterations of a step, to 0.01 of the length", iterationsToLength(nu, .01), kMost));
    }
    return all;
}

}  // namespace vdbfrac::tools::verify
