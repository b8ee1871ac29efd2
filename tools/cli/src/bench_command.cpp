// vdbfrac bench: the standard workloads, timed, with their work counts, as JSON.
#include "options.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/bench/bench.h>

#include <algorithm>
#include <cstdio>

namespace vdbfrac::cli {

namespace bench = lab::bench;

namespace {

const std::vector<std::string> kWorkloads = {"floors", "block",   "tear",    "touch",
                                             "stages", "solvers", "kernels", "memory"};

struct BenchOptions {
    CommonOptions common;
    std::string set = "standard", file;
    std::vector<std::string> only = kWorkloads;
    int threads = 0;
};

bench::Plan planOf(const std::string& set)
{
    constexpr int kAll = 1 << 20;  // more steps than a run has: to its last frame
    bench::Plan plan;
    if (set == "quick") {
        plan.blocks = {{20, 12}}, plan.tears = {{20, 4, 24}}, plan.touches = {{16, 5}};
        plan.solverSizes = {17, 33}, plan.residualSizes = {9};
        return plan;
    }
    plan.memoryNodes = 40;
    plan.residualSizes = {17, 33};
    if (set == "standard") {
        plan.blocks = {{20, 12}, {40, 12}, {60, 6}}, plan.tears = {{20, 40}, {50, 10}}, plan.ballVoxels = 64;
        plan.touches = {{16, 5}, {64, 5}};
        plan.solverSizes = {17, 33, 65};
        return plan;
    }
    plan.blocks = {{20, 12}, {40, 12}, {60, 6}, {80, 4}, {100, 3}, {128, 2}};
    plan.tears = {{20, kAll}, {50, 40}, {100, 6}}, plan.touches = {{16, 5}, {64, 5}, {126, 5}};
    plan.ballVoxels = 128;
    plan.solverSizes = {17, 33, 65, 129}, plan.residualSizes = {17, 33, 65};
    return plan;
}

bench::Json measure(const BenchOptions& options, const bench::Plan& plan, const bench::Say& say)
{
    const auto wanted = [&](const char* name) {
        return std::find(options.only.begin(), options.only.end(), name) != options.only.end();
    };
    bench::Json result = {{"program", "vdbfrac"},
                          {"version", core::kVersion},
                          {"set", options.set},
                          {"machine", bench::describeMachine(plan.threads)}};
    // Memory comes first, before anything else has left holes in it that would be filled.
    if (wanted("memory")) result["memory"] = bench::benchMemory(plan, say);
    // The block and the stages are measured against the floors.
    bench::Floors floors;
    if (wanted("floors") || wanted("block") || wanted("stages")) {
        say("floors: memory and arithmetic");
        floors = bench::measureFloors(plan.threads);
        result["floors"] = bench::toJson(floors);
    }
    for (const bench::BlockSize& size : plan.blocks)
        if (wanted("block")) result["block"].push_back(bench::benchBlock(size, plan.threads, floors, say));
    for (const bench::TearSize& size : plan.tears)
        if (wanted("tear")) result["tear"].push_back(bench::benchTear(size, say));
    for (const bench::TouchSize& size : plan.touches)
        if (wanted("touch")) result["touch"].push_back(bench::benchTouch(size, say));
    if (wanted("stages")) result["stages"] = bench::benchStages(plan.ballVoxels, floors, say);
    if (wanted("solvers")) result["solvers"] = bench::benchSolvers(plan, say);
    if (wanted("kernels")) result["kernels"] = bench::benchKernels(plan.ballVoxels, plan.threads, say);
    return result;
}

int run(const BenchOptions& options)
{
    const ThreadLimit limit(options.threads);
    bench::Plan plan = planOf(options.set);
    plan.threads = threadCount();
    const auto log = makeLog(options.common);
    const std::string text =
        measure(options, plan, [&](const std::string& line) { log->info("{}", line); }).dump(1) + "\n";
    if (options.file.empty())
        std::fputs(text.c_str(), stdout);
    else
        writeText(options.file, text);
    return kDone;
}

}  // namespace

Action addBench(CLI::App& app)
{
    auto o = std::make_shared<BenchOptions>();
    CLI::App* c =
        app.add_subcommand("bench", "Time the standard workloads on this machine; prints JSON with work counts");
    c->add_option("--set", o->set, "How much: some seconds, some minutes, or an hour")
        ->check(CLI::IsMember({"quick", "standard", "full"}))
        ->capture_default_str();
    c->add_option("--only", o->only, "Which workloads; 'block' and 'stages' measure the floors too")
        ->delimiter(',')
        ->check(CLI::IsMember(kWorkloads))
        ->capture_default_str();
    addThreads(*c, o->threads);
    c->add_option("-o,--output", o->file, "Write the JSON to this file instead of stdout")->type_name("FILE");
    c->add_flag("-q,--quiet", o->common.quiet, "No progress messages");
    c->add_option("--log-file", o->common.logFile, "Write the progress messages to this file too")->type_name("FILE");
    return [o] { return run(*o); };
}

}  // namespace vdbfrac::cli
