// How linear solvers grow with the nodes: one Newton iteration from rest, a step in time and a static one, on the block
// whole and half torn. And the exponents of it.
#include "block_problem.h"
#include "solvers.h"

#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/timing.h>

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace vdbfrac::lab::bench {

const char* nameOf(solver::LinearMethod method)
{
    switch (method) {
    case solver::LinearMethod::jacobi: return "jacobi";
    case solver::LinearMethod::multigrid: return "multigrid";
    case solver::LinearMethod::direct: return "direct";
    case solver::LinearMethod::automatic: break;
    }
    return "auto";
}

namespace {

constexpr double kMoved = kBlockStep * kBlockSpeed;  // m, of the top, in both problems
constexpr int kLargestStaticJacobi = 65;             // nodes a side: beyond that it takes minutes
constexpr int kLarge = 100;                          // nodes a side: from here on once is enough

const char* crackName(Crack crack)
{
    return crack == Crack::none ? "none" : crack == Crack::aligned ? "aligned" : "between";
}

/// One line of the table, over all sizes.
struct Series {
    solver::LinearMethod method;
    bool quasiStatic;
    Crack crack;

    Json toJson() const
    {
        return {
            {"method", nameOf(method)}, {"problem", quasiStatic ? "static" : "dynamic"}, {"crack", crackName(crack)}};
    }
};

solver::NewtonSettings oneIteration(solver::LinearMethod method)
{
    solver::NewtonSettings s;
    s.iterations = 1;
    s.tolerance = 0;  // linear systems are then solved to linearTolerance and no less
    s.linearTolerance = 1e-6;
    s.linearIterations = 20000;
    s.linearMethod = method;
    return s;
}

/// The same step several times, always from rest. The first also builds what belongs to the mesh, as the first step
/// after a cut does.
Json measure(const Series& series, int n)
{
    BlockProblem block(n, series.crack);
    solver::BackwardEuler stepper(block.elastic, oneIteration(series.method));
    block.moveTop(kMoved);
    const double dt = series.quasiStatic ? std::numeric_limits<double>::infinity() : kBlockStep;
    solver::State state;
    const solver::StepReport* report = nullptr;
    const auto step = [&] { report = &stepper.step(state, dt, {{}, block.boundary}); };

    state = block.state;
    const double first = secondsOf(step);
    const std::int64_t products = block.elastic.work().products;
    double seconds = std::numeric_limits<double>::infinity();
    for (int r = n < kLarge ? 4 : 1; r > 0; --r) {
        state = block.state;
        seconds = std::min(seconds, secondsOf(step));
    }
    Json row = {{"n", n}, {"nodes", block.elastic.nodeCount()}};
    row.update(series.toJson());
    row.update({{"newton_iterations", report->newtonIterations},  // 0: the linear solver has failed
                {"linear_iterations", report->linearIterations},
                {"products", products},
                {"seconds", seconds},
                {"first_seconds", first}});
    return row;
}

/// Slope of log(seconds) over log(nodes) by least squares.
double exponent(const Json& rows, const char* key)
{
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (const Json& r : rows) {
        mx += std::log(r["nodes"].get<double>()) / double(rows.size());
        my += std::log(r[key].get<double>()) / double(rows.size());
    }
    for (const Json& r : rows) {
        const double x = std::log(r["nodes"].get<double>()) - mx;
        xx += x * x;
        xy += x * (std::log(r[key].get<double>()) - my);
    }
    return xy / xx;
}

Json measureAll(const Series& series, const std::vector<int>& sizes, const Say& say)
{
    Json rows = Json::array();
    for (int n : sizes) {
        if (series.method == solver::LinearMethod::jacobi && series.quasiStatic && n > kLargestStaticJacobi) continue;
        rows.push_back(measure(series, n));
        const Json& r = rows.back();
        say(fmt::format("solvers n = {}, {}, {}, crack {}: {} iterations, {} products, {:.4f} s", n,
                        nameOf(series.method), series.quasiStatic ? "static" : "dynamic", crackName(series.crack),
                        r["linear_iterations"].get<int>(), r["products"].get<int>(), r["seconds"].get<double>()));
    }
    return rows;
}

}  // namespace

void benchScaling(const std::vector<int>& sizes, const Say& say, Json& result)
{
    result["scaling"] = result["exponents"] = Json::array();
    for (bool quasiStatic : {false, true})
        for (Crack crack : {Crack::none, Crack::aligned, Crack::between})
            for (auto method : {solver::LinearMethod::jacobi, solver::LinearMethod::multigrid}) {
                // Has no coarse lattices.
                if (crack == Crack::between && method == solver::LinearMethod::jacobi) continue;
                const Series series{method, quasiStatic, crack};
                const Json rows = measureAll(series, sizes, say);
                for (const Json& r : rows) result["scaling"].push_back(r);
                Json fit = series.toJson();
                fit.update({{"seconds", exponent(rows, "seconds")}, {"products", exponent(rows, "products")}});
                result["exponents"].push_back(fit);
            }
}

Json benchSolvers(const Plan& plan, const Say& say)
{
    Json result = {{"threads", plan.threads}};
    benchScaling(plan.solverSizes, say, result);
    benchResiduals(plan.residualSizes, say, result);
    return result;
}

}  // namespace vdbfrac::lab::bench
