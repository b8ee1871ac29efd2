// Ways to advance in time: their orders, what they keep, what they lose, where they stop being stable.
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/solver/integrator.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

using namespace vdbfrac;
using solver::Scheme;

namespace {

/// A shaken soft block: free, or held at its floor.
struct Shaken {
    lab::Block block{{4, 3, 3}, 0.1};
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e4, .3, 1000));
    solver::State state = lab::shaken(block, 0.02, 0.05, 3);
    solver::Boundary boundary = lab::freeBoundary(block.nodes.size());

    solver::StepLoads loads()
    {
        return {{}, [this](double) -> const solver::Boundary& { return boundary; }};
    }
    double energy() const { return elastic.evaluate(state.x, {}, nullptr) + lab::kineticEnergy(elastic, state.v); }

    /// Steps to `time`.
    void run(Scheme scheme, double time, int steps)
    {
        const auto integrator = solver::makeIntegrator(scheme, elastic, lab::tightSettings());
        for (int i = 0; i < steps; ++i)
            EXPECT_EQ(integrator->step(state, time / steps, loads()).status, solver::StepStatus::converged);
    }
};

double distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).squaredNorm();
    return std::sqrt(sum);
}

struct Order {
    Scheme scheme;
    int steps;  // of the coarsest run
    double expected;
};

class Orders : public testing::TestWithParam<Order> {};

TEST_P(Orders, ErrorFallsWithTheOrderOfTheScheme)
{
    constexpr double kTime = 0.02, kAllowed = 0.15;
    Shaken exact;
    exact.run(Scheme::midpoint, kTime, 16 * GetParam().steps);
    double error[2];
    for (int level = 0; level < 2; ++level) {
        Shaken block;
        block.run(GetParam().scheme, kTime, GetParam().steps << level);
        error[level] = distance(block.state.x, exact.state.x);
    }
    const double order = std::log2(error[0] / error[1]);
    std::printf("errors %.3e %.3e, order %.3f\n", error[0], error[1], order);
    EXPECT_NEAR(order, GetParam().expected, kAllowed);
}

INSTANTIATE_TEST_SUITE_P(Schemes, Orders,
                         testing::Values(Order{Scheme::backwardEuler, 128, 1}, Order{Scheme::midpoint, 32, 2},
                                         Order{Scheme::sdirk2, 32, 2}, Order{Scheme::symplecticEuler, 64, 1},
                                         Order{Scheme::forwardEuler, 128, 1}));

/// Symplectic Euler is leapfrog whose velocities lag by half a step: started with such velocities, positions converge
/// with second order, and so do periods from any start.
TEST(Integrators, SymplecticEulerIsOfSecondOrderInPeriods)
{
    constexpr double kTime = 0.02, kAllowed = 0.15;
    Shaken exact;
    exact.run(Scheme::midpoint, kTime, 1024);
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const int steps = 64 << level;
        Shaken block;
        std::vector<Vec3> gradient(block.state.x.size(), Vec3::Zero());
        block.elastic.evaluate(block.state.x, gradient, nullptr);
        for (std::size_t i = 0; i < gradient.size(); ++i)
            block.state.v[i] += 0.5 * kTime / steps / block.elastic.mass()[i] * gradient[i];
        block.run(Scheme::symplecticEuler, kTime, steps);
        error[level] = distance(block.state.x, exact.state.x);
    }
    EXPECT_NEAR(std::log2(error[0] / error[1]), 2, kAllowed);
}

TEST(Integrators, OfSecondOrderFallFreelyWithoutError)
{
    constexpr double g = 9.81, dt = 0.05, kExact = 1e-12;  // relative: rounding of some ten steps and sums
    for (const Scheme scheme : {Scheme::midpoint, Scheme::sdirk2}) {
        Shaken block;
        block.state = lab::atRest(block.block);
        for (std::size_t i = 0; i < block.boundary.force.size(); ++i)
            block.boundary.force[i] = Vec3(0, 0, -g * block.elastic.mass()[i]);
        block.run(scheme, 10 * dt, 10);
        const double fallen = g * 10 * dt * 10 * dt / 2;
        for (std::size_t i = 0; i < block.state.x.size(); ++i)
            EXPECT_NEAR(block.block.h * block.block.nodes[i].z - block.state.x[i].z(), fallen, kExact * (1 + fallen));
    }
}

TEST(Integrators, AllKeepLinearMomentum)
{
    constexpr double kAStep = 1e-13;  // relative to sum m |v|
    for (const Scheme scheme :
         {Scheme::backwardEuler, Scheme::midpoint, Scheme::sdirk2, Scheme::symplecticEuler, Scheme::forwardEuler}) {
        Shaken block;
        for (Vec3& v : block.state.v) v += Vec3(1, 2, -1);
        const lab::Momentum before = lab::momentum(block.elastic, block.state.v);
        block.run(scheme, 0.01, 20);
        const lab::Momentum after = lab::momentum(block.elastic, block.state.v);
        EXPECT_LE((after.linear - before.linear).norm(), 20 * kAStep * before.scale) << int(scheme);
    }
}

TEST(Integrators, EnergyIsKeptByMidpointLostByBackwardEulerAndGainedByForwardEuler)
{
    const auto change = [](Scheme scheme) {
        Shaken block;
        const double before = block.energy();
        block.run(scheme, 0.1, 200);
        return block.energy() / before - 1;
    };
    const double midpoint = change(Scheme::midpoint), sdirk2 = change(Scheme::sdirk2),
                 backward = change(Scheme::backwardEuler), symplectic = change(Scheme::symplecticEuler),
                 forward = change(Scheme::forwardEuler);
    std::printf("midpoint %.2e  sdirk2 %.2e  backward Euler %.2e  symplectic Euler %.2e  forward Euler %.2e\n",
                midpoint, sdirk2, backward, symplectic, forward);
    EXPECT_LT(std::abs(midpoint), 1e-2);  // the energy is not quadratic: to second order in dt, without a drift
    EXPECT_LT(std::abs(symplectic), 0.1);
    EXPECT_LT(backward, -0.1);
    EXPECT_LT(sdirk2, 0);
    EXPECT_GT(sdirk2, 0.5 * backward);
    EXPECT_GT(forward, 0.1);
}

TEST(Integrators, ExplicitOnesAreStableUpToTheirLimitAndNotFarBeyond)
{
    const auto growth = [](double limits) {
        Shaken block;
        const double before = block.energy();
        const double dt =
            limits * solver::makeIntegrator(Scheme::symplecticEuler, block.elastic, {})->largestStep({}, {});
        block.run(Scheme::symplecticEuler, 500 * dt, 500);
        return block.energy() / before;
    };
    EXPECT_LT(growth(1), 2);
    EXPECT_GT(growth(2), 1e6);  // the limit is less than half of what would still do
    EXPECT_EQ(solver::makeIntegrator(Scheme::backwardEuler, Shaken().elastic, {})->largestStep({}, {}),
              std::numeric_limits<double>::infinity());
}

/// A step that does not hold is taken again from where it began, and nothing of it may be left.
TEST(Integrators, StepsThatAreCutBackLeaveNothing)
{
    constexpr double dt = 1e-3, kRounding = 1e-12;  // relative; of implicit schemes the tolerance
    for (const Scheme scheme :
         {Scheme::backwardEuler, Scheme::midpoint, Scheme::sdirk2, Scheme::symplecticEuler, Scheme::forwardEuler}) {
        Shaken once, twice;
        once.run(scheme, dt / 2, 1);
        const solver::State before = twice.state;
        const auto integrator = solver::makeIntegrator(scheme, twice.elastic, lab::tightSettings());
        (void)integrator->step(twice.state, dt, twice.loads());
        EXPECT_GT(distance(twice.state.x, once.state.x), 1e-3 * distance(once.state.x, before.x));
        twice.state = before;
        (void)integrator->step(twice.state, dt / 2, twice.loads());
        const double moved = distance(once.state.x, before.x);
        EXPECT_LT(distance(twice.state.x, once.state.x), kRounding * moved) << int(scheme);
        EXPECT_LT(distance(twice.state.v, once.state.v), kRounding * moved / dt) << int(scheme);
    }
}

TEST(Integrators, HeldNodesFollowTheirTargetsExactly)
{
    for (const Scheme scheme :
         {Scheme::midpoint, Scheme::sdirk2, Scheme::symplecticEuler, Scheme::forwardEuler, Scheme::statics}) {
        Shaken block;
        block.state = lab::atRest(block.block);
        block.boundary = lab::clamped(block.block, [](Coord c) { return c.z == 0; });
        const Vec3 shift(0.001, 0, -0.002);
        const auto integrator = solver::makeIntegrator(scheme, block.elastic, lab::tightSettings());
        std::vector<Vec3> before = block.boundary.target;
        solver::Boundary between = block.boundary;
        const solver::StepLoads loads{{}, [&](double share) -> const solver::Boundary& {
                                          for (std::size_t n = 0; n < before.size(); ++n)
                                              between.target[n] = before[n] + share * shift;
                                          return between;
                                      }};
        for (int i = 0; i < 5; ++i, before = block.boundary.target) {
            for (Vec3& target : block.boundary.target) target += shift;
            EXPECT_EQ(integrator->step(block.state, 1e-3, loads).status, solver::StepStatus::converged);
            for (std::size_t n = 0; n < block.state.x.size(); ++n) {
                if (block.boundary.fixed[n]) {
                    EXPECT_LE((block.state.x[n] - block.boundary.target[n]).norm(), 1e-15) << int(scheme);
                    EXPECT_LE(
                        (block.state.v[n] - (scheme == Scheme::statics ? Vec3::Zero().eval() : Vec3(shift / 1e-3)))
                            .norm(),
                        1e-10)
                        << int(scheme);
                }
            }
        }
    }
}

/// What holds the floor is the weight, once all is at rest.
TEST(Integrators, ReactionOfAStaticStepIsTheWeight)
{
    Shaken block;
    block.boundary = lab::clamped(block.block, [](Coord c) { return c.z == 0; });
    double weight = 0;
    for (std::size_t i = 0; i < block.boundary.force.size(); ++i) {
        if (block.boundary.fixed[i]) continue;
        block.boundary.force[i] = Vec3(0, 0, -9.81 * block.elastic.mass()[i]);
        weight += 9.81 * block.elastic.mass()[i];
    }
    const auto integrator = solver::makeIntegrator(Scheme::statics, block.elastic, lab::tightSettings());
    const solver::StepReport& report = integrator->step(block.state, 1, block.loads());
    Vec3 sum = Vec3::Zero();
    for (const Vec3& r : report.reaction) sum += r;
    EXPECT_LT((sum - Vec3(0, 0, weight)).norm(), 1e-9 * weight);
    EXPECT_EQ(lab::kineticEnergy(block.elastic, block.state.v), 0);
}

/// What holds a body everywhere and moves it from rest in a step: its mass times its acceleration, less its weight.
TEST(Integrators, ReactionOfWhatIsHeldIsItsInertiaLessItsWeight)
{
    constexpr double dt = 1e-3, kRounding = 1e-9;  // relative
    const Vec3 g(1, -2, -9), shift(2e-5, -1e-5, 4e-5);
    for (const Scheme scheme : {Scheme::backwardEuler, Scheme::symplecticEuler, Scheme::forwardEuler, Scheme::statics})
        for (const bool moves : {false, true}) {
            Shaken block;
            block.state = lab::atRest(block.block);
            block.boundary = lab::clamped(block.block, [](Coord) { return true; });
            double mass = 0;
            for (std::size_t i = 0; i < block.boundary.force.size(); ++i) {
                block.boundary.force[i] = block.elastic.mass()[i] * g;
                mass += block.elastic.mass()[i];
                if (moves) block.boundary.target[i] += shift;
            }
            const auto integrator = solver::makeIntegrator(scheme, block.elastic, lab::tightSettings());
            const solver::StepReport& report = integrator->step(block.state, dt, block.loads());
            Vec3 sum = Vec3::Zero();
            for (const Vec3& r : report.reaction) sum += r;
            const Vec3 acceleration = moves && scheme != Scheme::statics ? Vec3(shift / (dt * dt)) : Vec3::Zero();
            EXPECT_LT((sum - mass * (acceleration - g)).norm(), kRounding * mass * (acceleration.norm() + g.norm()))
                << int(scheme);
        }
}

/// A block in equilibrium under its weight stays there, and what holds its floor is the weight.
TEST(Integrators, ReactionInEquilibriumIsTheWeightUnderEveryScheme)
{
    constexpr double kSolved = 1e-8;  // relative: the equilibrium as statics found it
    for (const Scheme scheme :
         {Scheme::backwardEuler, Scheme::midpoint, Scheme::sdirk2, Scheme::symplecticEuler, Scheme::forwardEuler}) {
        Shaken block;
        block.state = lab::atRest(block.block);
        block.boundary = lab::clamped(block.block, [](Coord c) { return c.z == 0; });
        Vec3 weight = Vec3::Zero();
        for (std::size_t i = 0; i < block.boundary.force.size(); ++i) {
            block.boundary.force[i] = block.elastic.mass()[i] * Vec3(1, -2, -9);
            weight += block.boundary.force[i];
        }
        const auto still = solver::makeIntegrator(Scheme::statics, block.elastic, lab::tightSettings());
        EXPECT_EQ(still->step(block.state, 1, block.loads()).status, solver::StepStatus::converged);
        const auto integrator = solver::makeIntegrator(scheme, block.elastic, lab::tightSettings());
        for (int n = 0; n < 3; ++n) {
            const solver::StepReport& report = integrator->step(block.state, 1e-3, block.loads());
            Vec3 sum = Vec3::Zero();
            for (const Vec3& r : report.reaction) sum += r;
            EXPECT_LT((sum + weight).norm(), kSolved * weight.norm()) << int(scheme);
        }
    }
}

}  // namespace
