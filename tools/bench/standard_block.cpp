// The standard block: n^3 nodes, unit cube, E = 1 MPa, nu = .3, rho = 1000 kg/m^3, dt = 1/240 s, bottom clamped, top
// moved up at .4 m/s; backward Euler from rest, one Newton iteration a step, linear solve to 1e-6 of the preconditioned
// residual, plain tets. The height a probe node has gained at the end says whether a timing counts.
#include "bench.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/backward_euler.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>

namespace vdbfrac::tools::bench {

namespace {

constexpr double kStep = 1. / 240;  // s
constexpr double kSpeed = 0.4;      // m/s, of the top

double secondsSince(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

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

/// Whole cells with a corner at the origin. No level set: its zero contour would cut the faces.
struct Mesh {
    std::vector<tetmesh::CellElement> elements;  // by block of 8^3 cells
    std::vector<Coord> nodes;
    double h;

    explicit Mesh(int n) : h(1. / (n - 1))
    {
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) nodes.push_back({x, y, z});
        std::vector<std::pair<Coord, Coord>> order;  // block, cell
        for (const Coord& c : nodes)
            if (c.x < n - 1 && c.y < n - 1 && c.z < n - 1) order.push_back({{c.x >> 3, c.y >> 3, c.z >> 3}, c});
        std::sort(order.begin(), order.end());
        for (const auto& [block, cell] : order) elements.push_back(element(n, block, cell));
    }

    static tetmesh::CellElement element(int n, const Coord& block, const Coord& cell)
    {
        tetmesh::CellElement e;
        e.patch = std::uint32_t((block.z * 1024 + block.y) * 1024 + block.x);
        e.fraction.fill(1);
        for (int k = 0; k < tetmesh::kCorners; ++k) {
            const Coord c = cell + Coord{k & 1, k >> 1 & 1, k >> 2 & 1};
            e.node[std::size_t(k)] = std::uint32_t((c.z * n + c.y) * n + c.x);
        }
        return e;
    }
};

class StandardBlock {
public:
    StandardBlock(int n, solver::LinearMethod method)
        : mesh_(n), elastic_(makeElastic()), stepper_(elastic_, settings(method)), probe_(std::size_t((n / 2 * n + int(0.75 * (n - 1))) * n + n / 2))
    {
        boundary_.target.assign(mesh_.nodes.size(), Vec3::Zero());
        boundary_.force.assign(mesh_.nodes.size(), Vec3::Zero());
        for (const Coord& c : mesh_.nodes) {
            state_.x.push_back(mesh_.h * c.toVec());
            state_.v.push_back(c.y == n - 1 ? Vec3(0, kSpeed, 0) : Vec3::Zero());
            boundary_.fixed.push_back(c.y == 0 || c.y == n - 1);
        }
    }

    const solver::ElasticOperator& elastic() const { return elastic_; }
    std::span<const Vec3> x() const { return state_.x; }
    double probe() const { return state_.x[probe_].y() - mesh_.h * mesh_.nodes[probe_].y; }

    const solver::BackwardEuler& stepper() const { return stepper_; }

    const solver::StepReport& step()
    {
        for (std::size_t i = 0; i < state_.x.size(); ++i)
            if (boundary_.fixed[i]) boundary_.target[i] = state_.x[i] + kStep * state_.v[i];
        return stepper_.step(state_, kStep, {{}, boundary_});
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
    solver::ElasticOperator makeElastic() const
    {
        const solver::ElementSet set{mesh_.elements, mesh_.nodes, 0, solver::makeMaterial(1e6, 0.3, 1000)};
        return solver::ElasticOperator(std::span(&set, 1), mesh_.nodes.size(), mesh_.h, solver::Volumetric::none);
    }

    Mesh mesh_;
    solver::ElasticOperator elastic_;
    solver::BackwardEuler stepper_;
    std::size_t probe_;
    solver::State state_;
    solver::Boundary boundary_;
};

/// Bytes that one iteration of conjugate gradients with block-Jacobi has to move: those of the product, then
///   r -= a (m p + K p), r.Br: mass, p, r twice, B, fixed;  u += a p, p = B r + b p, p.Mp: r, B, p twice, u twice, mass, fixed.
double bytesOfIteration(const solver::ElasticOperator& elastic)
{
    constexpr double kVector = sizeof(Vec3), kBlock = 6 * sizeof(float), kMass = sizeof(double);
    constexpr double kResidual = kMass + 3 * kVector + kBlock + 1, kDirection = 5 * kVector + kBlock + kMass + 1;
    return double(elastic.productBytes()) + double(elastic.nodeCount()) * (kResidual + kDirection);
}

/// Seconds of one pass over the elements for energy, gradient and tangent; the best of several.
double evaluationSeconds(const StandardBlock& block)
{
    constexpr int kRepetitions = 4;
    std::vector<Vec3> gradient(block.x().size(), Vec3::Zero());
    solver::Tangent tangent;
    (void)block.elastic().evaluate(block.x(), gradient, &tangent);  // touches its memory
    double best = std::numeric_limits<double>::infinity();
    for (int r = 0; r < kRepetitions; ++r) {
        const auto start = std::chrono::steady_clock::now();
        (void)block.elastic().evaluate(block.x(), gradient, &tangent);
        best = std::min(best, secondsSince(start));
    }
    return best;
}

struct Measured {
    double seconds = 0, fastest = std::numeric_limits<double>::infinity();  // of all steps, of one
    int newton = 0, linear = 0;
    solver::ElasticWork work;
    double evaluation = 0;  // s
    double bytes = 0;       // of an iteration
    double nodes = 0, tets = 0;
    double probe = 0;        // m
    double solverBytes = 0;  // operator and stepper
};

Measured measure(const BlockSize& size, solver::LinearMethod method)
{
    StandardBlock block(size.n, method);
    Measured m;
    for (int s = 0; s < size.steps; ++s) {
        const auto start = std::chrono::steady_clock::now();
        const solver::StepReport& report = block.step();
        const double seconds = secondsSince(start);
        m.seconds += seconds;
        m.fastest = std::min(m.fastest, seconds);
        m.newton += report.newtonIterations;
        m.linear += report.linearIterations;
    }
    m.work = block.elastic().work();
    m.evaluation = evaluationSeconds(block);
    m.bytes = bytesOfIteration(block.elastic());
    m.nodes = double(block.elastic().nodeCount());
    m.tets = double(block.elastic().tetCount());
    m.probe = block.probe();
    m.solverBytes = double(block.elastic().bytes() + block.stepper().bytes());
    return m;
}

Json toJson(const Measured& m, const BlockSize& size, int threads, double bandwidth)
{
    const double iteration = (m.seconds - double(m.work.evaluations) * m.evaluation) / m.linear;
    const double bound = m.bytes / bandwidth;
    return {{"threads", threads},
            {"seconds_a_step", m.seconds / size.steps},
            {"seconds_of_fastest_step", m.fastest},
            {"newton_iterations", m.newton},
            {"linear_iterations", m.linear},
            {"evaluations", m.work.evaluations},
            {"products", m.work.products},
            {"evaluation_ns_a_tet", 1e9 * m.evaluation / m.tets},
            {"iteration_ns_a_node", 1e9 * iteration / m.nodes},
            {"bytes_a_node_and_iteration", m.bytes / m.nodes},
            {"gb_per_s", 1e-9 * m.bytes / iteration},
            {"floor_gb_per_s", 1e-9 * bandwidth},
            {"floor_ns_a_node", 1e9 * bound / m.nodes},
            {"share_of_floor", bound / iteration}};
}

Json benchMultigrid(const BlockSize& size, int threads, const Say& say)
{
    const ThreadLimit limit(threads);
    const Measured m = measure(size, solver::LinearMethod::multigrid);
    say(fmt::format("block n = {}, multigrid, {} threads: {:.4f} s a step, {} iterations, probe {:.6e} m", size.n, threads,
                    m.seconds / size.steps, m.linear, m.probe));
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
        runs.push_back(toJson(last, size, t, floors.readBandwidth(t, last.bytes)));
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

}  // namespace vdbfrac::tools::bench
