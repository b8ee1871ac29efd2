// What motion has to keep, however long or odd it is.
#include "cases.h"

#include <vdbfrac/lab/samples/cantilever.h>
#include <vdbfrac/lab/samples/crack.h>

#include <malloc.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

/// A block of 6 x 4 x 6 cells, held at its bottom and torn through at half its height: the upper half is a fragment.
struct TornBlock {
    static constexpr int kPlane = 3;
    Block block{{6, 4, 6}, .1};
    std::size_t whole = block.nodes.size();
    solver::Boundary boundary;

    TornBlock()
    {
        openCrack(block, {&Coord::z, kPlane}, [](Coord) { return true; });
        boundary = clamped(block, [](Coord c) { return c.z == 0; });
        for (std::size_t i = 0; i < block.nodes.size(); ++i) boundary.part.push_back(isLoose(i));
    }
    bool isLoose(std::size_t i) const { return i >= whole || block.nodes[i].z > kPlane; }
    double length() const { return 6 * block.h; }
};

/// The static equilibrium of a torn block, and how many nodes are not part of it because nothing holds them.
struct Equilibrium {
    solver::State state;
    std::size_t frozen = 0;
    bool converged = false;
};

/// That of a block under a force per mass [m/s^2], from a shaken start.
Equilibrium equilibrium(const Block& block, solver::Boundary boundary, double nu, const Vec3& pull)
{
    const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    for (std::size_t i = 0; i < block.nodes.size(); ++i) boundary.force[i] = elastic.mass()[i] * pull;
    Equilibrium e{shaken(block, .05, 0, 2)};
    const auto report = solver::stepBackwardEuler(elastic, e.state, kStatic, {{}, boundary}, {});
    e.frozen = report.frozenNodes;
    e.converged = report.status == solver::StepStatus::converged;
    return e;
}

/// Largest of f(node) over the nodes; a NaN stays.
template <class F>
double largest(std::size_t count, const F& f)
{
    double most = 0;
    for (std::size_t i = 0; i < count; ++i)
        if (const double value = f(i); !(value <= most)) most = value;
    return most;
}

/// Largest difference between the held half of the torn block and the same half alone, both under their weight,
/// relative to how far it sags.
double heldHalfDiffers(const TornBlock& torn, const Equilibrium& both, double nu, const Vec3& pull)
{
    const Block half({6, 4, TornBlock::kPlane}, torn.block.h);
    const solver::Boundary boundary = clamped(half, [](Coord c) { return c.z == 0; });
    const Equilibrium alone = equilibrium(half, boundary, nu, pull);
    const std::vector<Vec3> rest = half.restPositions();
    const double sag = largest(rest.size(), [&](std::size_t i) { return (alone.state.x[i] - rest[i]).norm(); });
    return largest(rest.size(),
                   [&](std::size_t i) {
                       const auto begin = torn.block.nodes.begin(),
                                  same = std::find(begin, begin + long(torn.whole), half.nodes[i]);
                       return (both.state.x[std::size_t(same - begin)] - alone.state.x[i]).norm();
                   }) /
           sag;
}

/// Positions, in lengths of a cell, of a free block after ten steps: lengths `length` times those of a block of 10 cm
/// cells, stiffness `stiffness` times its 1e5 Pa, and the density at which time runs alike.
std::vector<Vec3> scaledRun(double nu, double length, double stiffness)
{
    const Block block({4, 3, 3}, .125 * length);
    const auto elastic =
        elasticOperator(block, solver::makeMaterial(1e5 * stiffness, nu, 1000 * stiffness / (length * length)));
    const solver::Boundary boundary = freeBoundary(block.nodes.size());
    solver::State state = shaken(block, .125, 0, 6);
    for (Vec3& v : state.v) v = Vec3(length, 0, -length);
    for (int n = 0; n < 10; ++n)
        (void)solver::stepBackwardEuler(elastic, state, 1. / 64, {{}, boundary}, tightSettings());
    for (Vec3& x : state.x) x /= block.h;
    return state.x;
}

double difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    double worst = 0, size = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = (a[i] - b[i]).norm();
        if (!(d <= worst)) worst = d;
        size = std::max(size, b[i].norm());
    }
    return worst / size;
}

double heapInUse()
{
    const auto info = mallinfo2();
    return double(info.uordblks + info.hblkhd);
}

}  // namespace

Measurements detachedDynamic(Extent)
{
    constexpr double kDrift = 1e-12;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const TornBlock torn;
        const auto elastic = elasticOperator(torn.block, solver::makeMaterial(1e5, nu, 1000));
        solver::State state = shaken(torn.block, .1, 1, 1);
        const auto loose = [&] {
            std::vector<Vec3> v = state.v;
            for (std::size_t i = 0; i < v.size(); ++i)
                if (!torn.isLoose(i)) v[i].setZero();
            return lab::momentum(elastic, v);
        };
        const Momentum start = loose();
        double worst = 0;
        for (int n = 0; n < 50; ++n) {
            (void)solver::stepBackwardEuler(elastic, state, .01, {{}, torn.boundary}, {});
            const double drift = (loose().linear - start.linear).norm() / start.scale;
            if (!(drift <= worst)) worst = drift;
        }
        all.push_back(atMost(at(nu) + "drift of the fragment's momentum in 50 steps, relative", worst, kDrift));
    }
    return all;
}

Measurements detachedStatic(Extent)
{
    constexpr double kBound = 10, kHeld = .01;  // ten times the Newton tolerance
    const Vec3 weight(0, 0, -9.81);
    Measurements all;
    for (double nu : kPoissonRatios) {
        const TornBlock torn;
        const solver::State start = shaken(torn.block, .05, 0, 2);
        const Equilibrium e = equilibrium(torn.block, torn.boundary, nu, weight);
        const double moved = largest(start.x.size(), [&](std::size_t i) { return (e.state.x[i] - start.x[i]).norm(); });
        const auto loose = std::count(torn.boundary.part.begin(), torn.boundary.part.end(), 1u);
        all.push_back(atMost(at(nu) + "displacement under its weight, in lengths", moved / torn.length(), kBound));
        all.push_back(atLeast(at(nu) + "steps of 1 that converge", e.converged, 1));
        all.push_back(atMost(at(nu) + "nodes of the fragment that are not counted",
                             std::abs(double(e.frozen) - double(loose)), 0));
        all.push_back(atMost(at(nu) + "difference of the held half from one alone, of its sag",
                             heldHalfDiffers(torn, e, nu, weight), kHeld));
    }
    return all;
}

Measurements longSteps(Extent)
{
    constexpr double kMomentum = 1e-10, kIterations = 120;
    const Block block({5, 4, 3}, 0.1);
    const solver::Boundary boundary = freeBoundary(block.nodes.size());
    solver::NewtonSettings settings;
    settings.iterations = int(kIterations);
    Measurements all;
    for (double nu : kPoissonRatios) {
        const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
        double iterations = 0, drift = 0, broken = 0;
        for (double dt : {0.1, 1., 30.})
            for (unsigned seed : {3, 4}) {
                solver::State state = shaken(block, 0.2, 0, seed);
                for (Vec3& v : state.v) v = Vec3(.1, 0, 0);
                const Momentum start = lab::momentum(elastic, state.v);
                const auto first = solver::stepBackwardEuler(elastic, state, dt, {{}, boundary}, settings);
                iterations =
                    std::max(iterations, first.status == solver::StepStatus::capped ? 1000. : first.newtonIterations);
                // Later steps may be capped: rounding is all that is left.
                for (int n = 0; n < 2; ++n)
                    (void)solver::stepBackwardEuler(elastic, state, dt, {{}, boundary}, settings);
                drift = std::max(drift, (lab::momentum(elastic, state.v).linear - start.linear).norm() / start.scale);
                broken += countNotFinite(state.x) + countNotFinite(state.v) > 0;
            }
        all.push_back(atMost(at(nu) + "runs that are not finite", broken, 0));
        all.push_back(atMost(at(nu) + "drift of momentum, relative", drift, kMomentum));
        all.push_back(atMost(at(nu) + "Newton iterations until a step has converged", iterations, kIterations));
    }
    return all;
}

Measurements unitsOfAnySize(Extent)
{
    constexpr double kAgree = 1e-9;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const std::vector<Vec3> plain = scaledRun(nu, 1, 1);
        double bits = 0;
        for (auto [length, stiffness] : {std::pair{0x1p-20, 1.}, std::pair{0x1p20, 1.}, std::pair{1., 0x1p23}})
            bits = std::max(bits, difference(scaledRun(nu, length, stiffness), plain));
        all.push_back(atMost(at(nu) + "difference under lengths times 1e-6, relative",
                             difference(scaledRun(nu, 1e-6, 1), plain), kAgree));
        all.push_back(atMost(at(nu) + "difference under lengths times 1e6, relative",
                             difference(scaledRun(nu, 1e6, 1), plain), kAgree));
        all.push_back(atMost(at(nu) + "difference under E = 1e12 Pa, relative",
                             difference(scaledRun(nu, 1, 1e7), plain), kAgree));
        all.push_back(atMost(at(nu) + "difference under powers of two", bits, 0));
    }
    return all;
}

Measurements manySteps(Extent extent)
{
    constexpr double kMomentum = 1e-9, kMemory = 1e6;
    const int steps = extent == Extent::full ? 100000 : 2000;
    const Block block({3, 2, 2}, 0.1);
    const solver::Boundary boundary = freeBoundary(block.nodes.size());
    Measurements all;
    for (double nu : kPoissonRatios) {
        const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
        solver::BackwardEuler stepper(elastic, {});
        solver::State state = shaken(block, .1, 1, 1);
        for (Vec3& v : state.v) v += Vec3(1, 2, -1);
        const Momentum start = lab::momentum(elastic, state.v);
        double heap = 0;
        for (int n = 0; n < steps; ++n) {
            if (n == 100) heap = heapInUse();
            (void)stepper.step(state, .01, {{}, boundary});
        }
        const std::string after = " after " + std::to_string(steps) + " steps";
        all.push_back(atMost(at(nu) + "drift of momentum" + after + ", relative",
                             (lab::momentum(elastic, state.v).linear - start.linear).norm() / start.scale, kMomentum));
        all.push_back(atMost(at(nu) + "growth of the heap" + after + ", bytes", heapInUse() - heap, kMemory));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
