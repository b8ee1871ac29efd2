// vdbfrac verify: does the program hold what it promises, on this machine? The hard cases and random scenes, as tables
// and as JSON.
#include "options.h"
#include "verify_random.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/verify/hard_case.h>

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

namespace vdbfrac::cli {

namespace verify = lab::verify;

namespace {

using Json = nlohmann::ordered_json;

struct VerifyOptions {
    CommonOptions common;
    bool hard = false, torture = false, quick = false;
    std::vector<std::string> only;
    std::string json;
    int threads = 0;
    RandomOptions random;
};

std::string numberText(double value) { return fmt::format("{:.3g}", value); }

/// JSON has no NaN and no infinity: null stands for them.
Json toJson(const verify::HardCase& c, const std::vector<verify::Measurement>& measured)
{
    Json all = Json::array();
    for (const verify::Measurement& m : measured)
        all.push_back({{"what", m.what},
                       {"value", std::isfinite(m.value) ? Json(m.value) : Json()},
                       {"bound", m.bound == verify::Bound::atMost ? "at most" : "at least"},
                       {"limit", m.limit},
                       {"holds", m.holds()}});
    return {{"row", c.row}, {"id", c.id}, {"case", c.title}, {"usual", c.usual}, {"measured", all}};
}

void printCase(const verify::HardCase& c, const std::vector<verify::Measurement>& measured)
{
    std::printf("%2d  %s%s\n", c.row, c.title, c.measure ? "" : ": not there yet");
    for (const verify::Measurement& m : measured)
        std::printf("    %-6s %10s  %s %-8s  %s\n", m.holds() ? "holds" : "FAILS", numberText(m.value).c_str(),
                    m.bound == verify::Bound::atMost ? "<=" : ">=", numberText(m.limit).c_str(), m.what.c_str());
    std::fflush(stdout);
}

/// A case that throws is one that does not hold, with what it said.
std::vector<verify::Measurement> measure(const verify::HardCase& c, verify::Extent extent)
{
    if (!c.measure) return {};
    try {
        return c.measure(extent);
    } catch (const std::exception& e) {
        return {{std::string("error: ") + e.what(), NAN, verify::Bound::atMost, 0}};
    }
}

/// The rows of the table that --only names, or all.
std::vector<verify::HardCase> chosenCases(const VerifyOptions& options)
{
    const auto hard = verify::hardCases(), torture = verify::tortureCases();
    const auto isNamed = [&](const verify::HardCase& c) {
        return std::find(options.only.begin(), options.only.end(), c.id) != options.only.end();
    };
    for (const verify::HardCase& c : options.torture ? hard : torture)
        if (isNamed(c))
            throw InputError(
                {"--only", std::string(c.id) + " goes with " + (options.torture ? "--hard" : "--torture"), "", ""});
    const auto table = options.torture ? torture : hard;
    std::vector<verify::HardCase> chosen;
    std::copy_if(table.begin(), table.end(), std::back_inserter(chosen),
                 [&](const verify::HardCase& c) { return options.only.empty() || isNamed(c); });
    return chosen;
}

int run(const VerifyOptions& options)
{
    const ThreadLimit limit(options.threads);
    if (options.random.scenes > 0) return runRandom(options.random, {options.json, options.common.quiet});
    Json all = {{"program", "vdbfrac"},
                {"version", core::kVersion},
                {"table", options.torture ? "torture" : "hard"},
                {"extent", options.quick ? "quick" : "full"},
                {"cases", Json::array()}};
    int holding = 0, failing = 0, missing = 0;
    for (const verify::HardCase& c : chosenCases(options)) {
        const auto measured = measure(c, options.quick ? verify::Extent::quick : verify::Extent::full);
        const bool holds = std::all_of(measured.begin(), measured.end(), [](const auto& m) { return m.holds(); });
        ++(measured.empty() ? missing : holds ? holding : failing);
        if (!options.common.quiet) printCase(c, measured);
        all["cases"].push_back(toJson(c, measured));
    }
    std::printf("%d cases hold, %d do not, %d are not there yet\n", holding, failing, missing);
    if (!options.json.empty()) writeText(options.json, all.dump(1) + "\n");
    return failing == 0 ? kDone : kNotConverged;
}

}  // namespace

Action addVerify(CLI::App& app)
{
    std::vector<std::string> ids;
    for (const auto cases : {verify::hardCases(), verify::tortureCases()})
        for (const verify::HardCase& c : cases) ids.push_back(c.id);
    auto o = std::make_shared<VerifyOptions>();
    CLI::App* c = app.add_subcommand(
        "verify", "Measure what the program promises against its limits; ends with 3 when one is missed");
    CLI::Option_group* which = c->add_option_group("Which");
    which->require_option(1);
    which->add_flag("--hard", o->hard, "The hard cases of the simulation");
    which->add_flag("--torture", o->torture, "Hard cases while something tears");
    CLI::Option* random = which->add_option("--random", o->random.scenes, "Random scenes, this many")
                              ->check(CLI::Range(1, 1000000))
                              ->type_name("N");
    c->add_option("--seed", o->random.seed, "Of the first random scene; the others follow")
        ->capture_default_str()
        ->needs(random);
    c->add_option("--keep", o->random.keep, "Write random scenes that break a law into this folder")
        ->type_name("DIR")
        ->needs(random);
    c->add_flag("--quick", o->quick, "Shorter runs where hard cases have long ones, as the tests do")->excludes(random);
    c->add_option("--only", o->only, "Which hard cases")
        ->delimiter(',')
        ->check(CLI::IsMember(ids))
        ->type_name("CASE,...")
        ->excludes(random);
    c->add_option("--json", o->json, "Write the measurements to this file too")->type_name("FILE");
    addThreads(*c, o->threads);
    c->add_flag("-q,--quiet", o->common.quiet, "Print the totals only");
    return [o] { return run(*o); };
}

}  // namespace vdbfrac::cli
