// Time until the nonlinear residual of a step is below a target, for each linear solver, with linear systems solved to
// the end and only as far as the target needs. All are judged by one checker.
#include "block_problem.h"
#include "solvers.h"

#include <vdbfrac/lab/machine/timing.h>

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace vdbfrac::lab::bench {

namespace {

constexpr double kTargets[] = {1e-2, 1e-4, 1e-6};
constexpr int kLargestDirect = 17;  // nodes a side: beyond that the factors take long, and gigabytes
constexpr int kRepetitions = 3;     // the best one counts

struct Setting {
    solver::LinearMethod method;
    bool exact;
};

constexpr Setting kSettings[] = {{solver::LinearMethod::jacobi, true},
                                 {solver::LinearMethod::jacobi, false},
                                 {solver::LinearMethod::multigrid, true},
                                 {solver::LinearMethod::multigrid, false},
                                 {solver::LinearMethod::direct, true}};

struct Run {
    std::vector<Vec3> x;
    double seconds = 0;
    int newton = 0, linear = 0;
    std::int64_t products = 0;
};

class Contest {
public:
    explicit Contest(int n) : block_(n), checker_(block_.elastic, {}) { block_.moveTop(kBlockStep * kBlockSpeed); }

    double residual(const std::vector<Vec3>& x)
    {
        return checker_.residual(block_.state, kBlockStep, {{}, block_.boundary}, x);
    }

    /// The stepper stops by itself where its systems are solved as far as needed. It would loosen every linear
    /// tolerance that is tighter than the target needs: exact solves ask for no target and get as many Newton
    /// iterations as the checker says it takes.
    Run run(const Setting& setting, double target)
    {
        if (!setting.exact) return best(settings(setting, target, 20));
        constexpr int kMax = 20;
        for (int newton = 1; newton < kMax; ++newton)
            if (residual(step(settings(setting, 0, newton)).x) < target) return best(settings(setting, 0, newton));
        return best(settings(setting, 0, kMax));
    }

private:
    static solver::NewtonSettings settings(const Setting& setting, double target, int newton)
    {
        solver::NewtonSettings s;
        s.tolerance = target;
        s.iterations = newton;
        s.linearTolerance = setting.exact ? 1e-6 : 1e-2;
        s.linearIterations = 20000;
        s.linearMethod = setting.method;
        return s;
    }

    /// One step from rest. Also builds what belongs to the mesh: each step here is the first.
    Run step(const solver::NewtonSettings& settings)
    {
        solver::State state = block_.state;
        const std::int64_t before = block_.elastic.work().products;
        Run run;
        run.seconds = secondsOf([&] {
            solver::BackwardEuler stepper(block_.elastic, settings);
            const solver::StepReport& report = stepper.step(state, kBlockStep, {{}, block_.boundary});
            run.newton = report.newtonIterations;
            run.linear = report.linearIterations;
        });
        run.products = block_.elastic.work().products - before;
        run.x = std::move(state.x);
        return run;
    }

    Run best(const solver::NewtonSettings& settings)
    {
        Run best = step(settings);
        for (int r = 1; r < kRepetitions; ++r) best.seconds = std::min(best.seconds, step(settings).seconds);
        return best;
    }

    BlockProblem block_;
    solver::BackwardEuler checker_;
};

}  // namespace

void benchResiduals(const std::vector<int>& sizes, const Say& say, Json& result)
{
    result["time_to_residual"] = Json::array();
    for (int n : sizes) {
        Contest contest(n);
        for (const Setting& setting : kSettings)
            for (double target : kTargets) {
                if (setting.method == solver::LinearMethod::direct && n > kLargestDirect) continue;
                const Run run = contest.run(setting, target);
                const double residual = contest.residual(run.x);
                const char* linear = setting.exact ? "exact" : "inexact";
                say(fmt::format("residual n = {}, {}, {}: {:.1e} (target {:.0e}) in {:.4f} s, {} Newton, {} linear", n,
                                nameOf(setting.method), linear, residual, target, run.seconds, run.newton, run.linear));
                result["time_to_residual"].push_back({{"n", n},
                                                      {"method", nameOf(setting.method)},
                                                      {"linear", linear},
                                                      {"target", target},
                                                      {"residual", residual},
                                                      {"seconds", run.seconds},
                                                      {"newton_iterations", run.newton},
                                                      {"linear_iterations", run.linear},
                                                      {"products", run.products}});
            }
    }
}

}  // namespace vdbfrac::lab::bench
