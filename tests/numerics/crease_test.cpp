// Steps that end at a crease of the energy, where the rotation of a tet jumps and no gradient is small: that they end
// in a minimum is looked up in the energy itself.
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/loads.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

using namespace vdbfrac;

namespace {

constexpr double dt = 0.01;     // s
constexpr double kNear = 1e-4;  // cells: how far from its crease a minimum may be (followCrease in backward_euler.cpp)

/// A few cells of a nearly incompressible material, blown up and shaken so that some tets are inverted; nothing holds
/// them.
struct BlownUp {
    lab::Block block;
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .45, 1000));
    solver::Boundary boundary = lab::freeBoundary(block.nodes.size());
    solver::State state;

    BlownUp(unsigned seed, double shake, int cells = 2)
        : block({cells, cells, cells}, .25), state(lab::shaken(block, shake, 1, seed))
    {
        for (Vec3& x : state.x) x *= 3;
    }
    solver::StepReport step(double tolerance, int iterations = 60)
    {
        solver::NewtonSettings settings;
        settings.tolerance = tolerance;
        settings.iterations = iterations;
        return solver::stepBackwardEuler(elastic, state, dt, {{}, boundary}, settings);
    }
};

/// Phi of the step from `start` [J], added up anew.
struct Objective {
    const solver::ElasticOperator& elastic;
    const solver::State& start;

    double operator()(std::span<const Vec3> x) const
    {
        double phi = elastic.evaluate(x, {}, nullptr);
        for (std::size_t i = 0; i < x.size(); ++i)
            phi += 0.5 * elastic.mass()[i] / (dt * dt) * (x[i] - start.x[i] - dt * start.v[i]).squaredNorm();
        return phi;
    }
    /// Its gradient [N].
    std::vector<Vec3> gradient(std::span<const Vec3> x) const
    {
        std::vector<Vec3> g(x.size(), Vec3::Zero());
        elastic.evaluate(x, g, nullptr);
        for (std::size_t i = 0; i < x.size(); ++i)
            g[i] += elastic.mass()[i] / (dt * dt) * (x[i] - start.x[i] - dt * start.v[i]);
        return g;
    }
};

double norm(std::span<const Vec3> a)
{
    double sum = 0;
    for (const Vec3& v : a) sum += v.squaredNorm();
    return std::sqrt(sum);
}

/// Unit directions in which Phi is looked at: some hundred at random, each node along its axes and against its force,
/// all of them against the force.
std::vector<std::vector<Vec3>> directionsAt(std::span<const Vec3> gradient, unsigned seed)
{
    constexpr int kRandom = 300;
    std::vector<std::vector<Vec3>> directions;
    const std::vector<Vec3> zero(gradient.size(), Vec3::Zero());
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < kRandom; ++k) {
        directions.push_back(zero);
        for (Vec3& d : directions.back())
            for (double& v : d) v = normal(random);
    }
    for (std::size_t i = 0; i < gradient.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis)
            for (double sign : {-1., 1.}) directions.push_back(zero), directions.back()[i][axis] = sign;
        directions.push_back(zero), directions.back()[i] = -gradient[i];
    }
    directions.push_back(zero);
    for (std::size_t i = 0; i < gradient.size(); ++i) directions.back()[i] = -gradient[i];
    for (auto& direction : directions) {
        const double size = norm(direction);
        for (Vec3& d : direction) d /= size;
    }
    return directions;
}

/// Farthest that Phi falls from x over a distance [m] in any of those directions [J].
double farthestFall(const Objective& phi, std::span<const Vec3> x, double distance, unsigned seed)
{
    double fall = 0;
    const double here = phi(x);
    std::vector<Vec3> there(x.size());
    for (const auto& direction : directionsAt(phi.gradient(x), seed)) {
        for (std::size_t i = 0; i < x.size(); ++i) there[i] = x[i] + distance * direction[i];
        fall = std::max(fall, here - phi(there));
    }
    return fall;
}

/// A step that ended at a crease, with what it began from.
struct Found {
    BlownUp body;
    solver::State start;
    solver::StepReport report;
    unsigned seed;
};

/// Calls `see` for every one of some dozen bodies whose step ends at a crease; how many they are.
template <class See>
int forCreases(double tolerance, const See& see)
{
    int count = 0;
    for (double shake : {.6, 1.})
        for (unsigned seed = 1; seed <= 30; ++seed) {
            Found found{BlownUp(seed, shake), {}, {}, seed};
            found.start = found.body.state;
            found.report = found.body.step(tolerance);
            if (found.report.creases == 0) continue;
            ++count;
            see(found);
        }
    return count;
}

/// What Phi may fall by over a distance [J]. The crease is up to kNear away, and Phi falls towards it with its
/// gradient; along the crease with the mean of the gradients, which is below the tolerance.
double allowedFall(const Found& f, std::span<const Vec3> x, double tolerance, double distance)
{
    std::vector<Vec3> elastic(x.size(), Vec3::Zero());
    f.body.elastic.evaluate(x, elastic, nullptr);
    const Objective phi{f.body.elastic, f.start};
    double inertia = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Vec3 moved = x[i] - f.start.x[i] - dt * f.start.v[i];
        inertia += (f.body.elastic.mass()[i] / (dt * dt) * moved).squaredNorm();
    }
    const double forceScale = std::max(norm(elastic), std::sqrt(inertia));
    return norm(phi.gradient(x)) * kNear * f.body.block.h + tolerance * forceScale * distance;
}

TEST(Creases, AStepThatEndsAtOneIsInAMinimumThoughItsGradientIsNotSmall)
{
    constexpr int kEnough = 8;  // creases to look at; of 60 steps there are 28, 24 and 11
    for (const double tolerance : {1e-2, 1e-3, 1e-5}) {
        double largest = 0, flattest = INFINITY, steepest = 0;
        const int count = forCreases(tolerance, [&](Found& f) {
            const std::vector<Vec3>& x = f.body.state.x;
            EXPECT_EQ(f.report.status, solver::StepStatus::converged);
            EXPECT_LE(f.report.residual, tolerance);
            solver::BackwardEuler checker(f.body.elastic, {});
            const double plain = checker.residual(f.start, dt, {{}, f.body.boundary}, x);
            EXPECT_GT(plain, tolerance) << "no crease is needed to tell that this is solved";
            flattest = std::min(flattest, plain), steepest = std::max(steepest, plain);
            const Objective phi{f.body.elastic, f.start};
            for (double cells : {1e-4, 1e-3}) {
                const double distance = cells * f.body.block.h, allowed = allowedFall(f, x, tolerance, distance);
                const double fall = farthestFall(phi, x, distance, f.seed);
                EXPECT_LE(fall, allowed) << "seed " << f.seed << ", " << cells << " cells away, tolerance "
                                         << tolerance;
                largest = std::max(largest, fall / allowed);
            }
        });
        std::printf(
            "tolerance %g: %d creases; plain residuals %.2g to %.2g; Phi falls by up to %.2f of what is allowed\n",
            tolerance, count, flattest, steepest, largest);
        EXPECT_GE(count, kEnough);
        EXPECT_GT(steepest, 10 * tolerance);
    }
}

/// The law above can fail: before Newton's method is through, Phi does fall.
TEST(Creases, ShortOfTheMinimumPhiFallsByMoreThanAtACrease)
{
    constexpr double kTolerance = 1e-3;
    forCreases(kTolerance, [&](Found& f) {
        BlownUp body(f.seed, .6);
        body.state = f.start;
        (void)body.step(kTolerance, f.report.newtonIterations / 2);
        const double distance = 1e-3 * body.block.h;
        const double fall = farthestFall({body.elastic, f.start}, body.state.x, distance, f.seed);
        EXPECT_GT(fall, allowedFall(f, body.state.x, kTolerance, distance)) << f.seed;
    });
}

TEST(Creases, AFreeBodyKeepsItsMomentumInAStepThatEndsAtOne)
{
    // Relative to sum m |v|: rounding of forces some hundred times m |v| / dt, which cancel.
    constexpr double kAStep = 1e-12;
    double worst = 0;
    forCreases(1e-3, [&](Found& f) {
        const lab::Momentum before = lab::momentum(f.body.elastic, f.start.v),
                            after = lab::momentum(f.body.elastic, f.body.state.v);
        worst = std::max(worst, (after.linear - before.linear).norm() / before.scale);
    });
    std::printf("worst drift of momentum in a step that ends at a crease: %.1e\n", worst);
    EXPECT_LE(worst, kAStep);
}

/// A body of several patches, for there to be work to share.
TEST(Creases, BitsDoNotDependOnTheNumberOfThreads)
{
    constexpr int kCells = 12;
    int creases = 0;
    for (unsigned seed = 1; seed <= 4; ++seed) {
        const auto end = [&](int threads) {
            const ThreadLimit limit(threads);
            BlownUp body(seed, .6, kCells);
            creases += body.step(1e-4).creases;
            return hashBytes(body.state.x.data(), body.state.x.size() * sizeof(Vec3));
        };
        const std::uint64_t one = end(1);
        EXPECT_EQ(end(2), one) << seed;
    }
    EXPECT_GT(creases, 0) << "nothing is shown";
}

}  // namespace
