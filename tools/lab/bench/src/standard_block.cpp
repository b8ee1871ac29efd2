// The standard block (block_problem.h) in steps of 1/240 s, the top at .4 m/s: backward Euler from rest, one Newton
// iteration a step, linear solve to 1e-6 of the preconditioned residual. The height a probe node has gained at the end
// says whether a timing counts.
#include "block_problem.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/timing.h>
#include <vdbfrac/solver/backward_euler.h>
#include <vdbfrac/solver/linear_solver.h>

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

namespace vdbfrac::lab::bench {

namespace {

/// Height [m] the probe has gained, computed by a program that shares no code with this one: assembled matrix,
/// rotations by Eigen's JacobiSVD, Eigen's conjugate gradients.
std::optional<double> referenceProbe(const BlockSize& size)
{
    struct Known {
        int n, steps;
        double value;
    };
    constexpr Known kKnown[] = {{20, 12, 1.592178e-2}, {40, 12, 1.606008e-2}, {60, 6, 7.125355e-3}};
    for (const Known& k : kKnown)
        if (k.n == size.n && k.steps == size.steps) return k.value;
    return {};
}

class StandardBlock {
public:
    StandardBlock(int n, solver::LinearMethod method)
        : block_(n),
          stepper_(block_.elastic, settings(method)),
          probe_(std::size_t((n / 2 * n + int(0.75 * (n - 1))) * n + n / 2))
    {
    }

    const solver::ElasticOperator& elastic() const { return block_.elastic; }
    std::span<const std::uint8_t> fixed() const { return block_.boundary.fixed; }
    std::span<const Vec3> x() const { return block_.state.x; }
    double probe() const { return x()[probe_].y() - block_.mesh.h * block_.mesh.nodes[probe_].y; }

    const solver::BackwardEuler& stepper() const { return stepper_; }

    const solver::StepReport& step()
    {
        block_.moveTop(kBlockStep * kBlockSpeed);
        return stepper_.step(block_.state, kBlockStep, {{}, block_.boundary});
    }

private:
    static solver::NewtonSettings settings(solver::LinearMethod method)
    {
        solver::NewtonSettings s;
        s.iterations = 1;
        s.tolerance = 0;
        s.linearTolerance = 1e-6;
        s.linearIterations = 20000;
        s.linearMethod = method;
        return s;
    }

    BlockProblem block_;
    solver::BackwardEuler stepper_;
    std::size_t probe_;
};

/// Bytes that one iteration of conjugate gradients with block-Jacobi has to move: those of the product, then
///   r -= a (m p + K p), r.Br: mass, p, r twice, B;  u += a p, p = B r + b p, p.Mp: r, B, p twice, u twice, mass.
Traffic trafficOfIteration(const solver::ElasticOperator& elastic)
{
    constexpr double kVector = sizeof(Vec3), kBlock = 6 * sizeof(float), kMass = sizeof(double);
    constexpr double kResidual = kMass + 3 * kVector + kBlock, kDirection = 5 * kVector + kBlock + kMass;
    constexpr double kWritten = 3 * kVector;  // r, u and p
    const double nodes = double(elastic.nodeCount()), slots = double(elastic.productBytesWritten());
    return {double(elastic.productBytes()) - slots + nodes * (kResidual + kDirection - kWritten),
            slots + nodes * kWritten};
}

/// Seconds of one pass over the elements for energy, gradient and tangent; the best of several.
double evaluationSeconds(const StandardBlock& block)
{
    constexpr int kRepetitions = 4;
    std::vector<Vec3> gradient(block.x().size(), Vec3::Zero());
    solver::Tangent tangent;
    (void)block.elastic().evaluate(block.x(), gradient, &tangent);  // touches its memory
    return fastest(kRepetitions, [&] { (void)block.elastic().evaluate(block.x(), gradient, &tangent); });
}

/// Seconds of one iteration of conjugate gradients with block-Jacobi, in double; in the best of as many windows as the
/// floors have.
double iterationSeconds(const StandardBlock& block)
{
    constexpr int kRepetitions = 15, kIterations = 20;
    const solver::ElasticOperator& elastic = block.elastic();
    std::vector<Vec3> load(block.x().size(), Vec3::Zero()), u(load.size());
    solver::Tangent tangent;
    (void)elastic.evaluate(block.x(), load, &tangent);
    solver::LinearSolver linear(elastic, solver::LinearMethod::jacobi);
    const solver::LinearSystem system{elastic, tangent, 1 / (kBlockStep * kBlockStep), block.fixed()};
    constexpr double kNever = 1e-30;
    int iterations = linear.solve(system, load, u, {kNever, 2}).iterations;  // makes the preconditioner
    const double seconds = fastest(kRepetitions, [&] {
        iterations = linear.solve(system, load, u, {kNever, kIterations}, true).iterations;
    });
    return seconds / iterations;
}

struct Measured {
    double seconds = 0;                                        // of all steps
    double fastest = std::numeric_limits<double>::infinity();  // step
    double iteration = 0;                                      // s, linear
    int newton = 0, linear = 0;
    solver::ElasticWork work;
    double evaluation = 0;  // s
    Traffic traffic;        // of an iteration
    double nodes = 0, tets = 0;
    double probe = 0;        // m
    double solverBytes = 0;  // operator and stepper
};

Measured measure(const BlockSize& size, solver::LinearMethod method)
{
    StandardBlock block(size.n, method);
    Measured m;
    for (int s = 0; s < size.steps; ++s) {
        const solver::StepReport* report = nullptr;
        const double seconds = secondsOf([&] { report = &block.step(); });
        m.seconds += seconds;
        m.fastest = std::min(m.fastest, seconds);
        m.newton += report->newtonIterations;
        m.linear += report->linearIterations;
    }
    m.work = block.elastic().work();
    m.evaluation = evaluationSeconds(block);
    if (method == solver::LinearMethod::jacobi) m.iteration = iterationSeconds(block);
    m.traffic = trafficOfIteration(block.elastic());
    m.nodes = double(block.elastic().nodeCount());
    m.tets = double(block.elastic().tetCount());
    m.probe = block.probe();
    m.solverBytes = double(block.elastic().bytes() + block.stepper().bytes());
    return m;
}

Json toJson(const Measured& m, const BlockSize& size, int threads, const Floors& floors)
{
    const double bound = floors.seconds(threads, m.traffic), bytes = m.traffic.bytes();
    return {{"threads", threads},
            {"seconds_a_step", m.seconds / size.steps},
            {"seconds_of_fastest_step", m.fastest},
            {"newton_iterations", m.newton},
            {"linear_iterations", m.linear},
            {"evaluations", m.work.evaluations},
            {"products", m.work.products},
            {"evaluation_ns_a_tet", 1e9 * m.evaluation / m.tets},
            {"iteration_ns_a_node", 1e9 * m.iteration / m.nodes},
            {"bytes_a_node_and_iteration", bytes / m.nodes},
            {"gb_per_s", 1e-9 * bytes / m.iteration},
            {"floor_gb_per_s", 1e-9 * bytes / bound},
            {"floor_ns_a_node", 1e9 * bound / m.nodes},
            {"share_of_floor", bound / m.iteration}};
}

Json benchMultigrid(const BlockSize& size, int threads, const Say& say)
{
    const ThreadLimit limit(threads);
    const Measured m = measure(size, solver::LinearMethod::multigrid);
    say(fmt::format("block n = {}, multigrid, {} threads: {:.4f} s a step, {} iterations, probe {:.6e} m", size.n,
                    threads, m.seconds / size.steps, m.linear, m.probe));
    return {{"threads", threads},
            {"seconds_a_step", m.seconds / size.steps},
            {"seconds_of_fastest_step", m.fastest},
            {"linear_iterations", m.linear},
            {"products", m.work.products},
            {"probe_m", m.probe},
            {"solver_bytes_a_node", m.solverBytes / m.nodes}};
}

}  // namespace

Json benchBlock(const BlockSize& size, int threads, const Floors& floors, const Say& say)
{
    Json runs = Json::array();
    Measured last;
    double alone = 0;
    for (int t : threadCounts(threads)) {
        const ThreadLimit limit(t);
        last = measure(size, solver::LinearMethod::jacobi);
        if (t == 1) alone = last.seconds;
        runs.push_back(toJson(last, size, t, floors));
        say(
            fmt::format("block n = {}, {} thread{}: {:.4f} s a step, {} iterations, {:.1f} ns a node and iteration "
                        "({:.0f} % of the floor), probe {:.6e} m",
                        size.n, t, t == 1 ? "" : "s", last.seconds / size.steps, last.linear,
                        runs.back()["iteration_ns_a_node"].get<double>(),
                        100 * runs.back()["share_of_floor"].get<double>(), last.probe));
    }
    const auto reference = referenceProbe(size);
    const Json multigrid = benchMultigrid(size, threads, say);
    return {{"n", size.n},
            {"nodes", std::int64_t(last.nodes)},
            {"tets", std::int64_t(last.tets)},
            {"steps", size.steps},
            {"probe_m", last.probe},
            {"reference_probe_m", reference ? Json(*reference) : Json()},
            {"runs", runs},
            {"speed_up", alone / last.seconds},
            {"multigrid", multigrid}};
}

}  // namespace vdbfrac::lab::bench
