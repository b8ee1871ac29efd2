// vdbfrac verify: does the program hold what it promises, on this machine? The hard cases, the cases in newtons and
// random scenes, as tables and as JSON.
#include "options.h"
#include "verify_random.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/verify/hard_case.h>

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <span>

namespace vdbfrac::cli {

namespace verify = lab::verify;

namespace {

using Json = nlohmann::ordered_json;

struct VerifyOptions {
    CommonOptions common;
    bool hard = false, torture = false, newtons = false, quick = false;
    std::vector<std::string> only;
    std::string json;
    int threads = 0;
    RandomOptions random;
};

struct Table {
    const char* name;
    std::span<const verify::HardCase> cases;
};

std::array<Table, 3> tables()
{
    return {{{"hard", verify::hardCases()}, {"torture", verify::tortureCases()}, {"newtons", verify::newtonCases()}}};
}

Table chosenTable(const VerifyOptions& options) { return tables()[options.newtons ? 2 : options.torture ? 1 : 0]; }

std::string numberText(double value) { return fmt::format("{:.3g}", value); }

const char* boundName(verify::Bound bound)
{
    switch (bound) {
    case verify::Bound::atMost: return "at most";
    case verify::Bound::atLeast: return "at least";
    case verify::Bound::within: return "within";
    }
    return "";
}

/// "<= 3", ">= 1", "1 +- 0.1".
std::string boundText(const verify::Measurement& m)
{
    if (m.bound == verify::Bound::within) return numberText(m.reference) + " +- " + numberText(m.limit);
    return (m.bound == verify::Bound::atMost ? "<= " : ">= ") + numberText(m.limit);
}

/// JSON has no NaN and no infinity: null stands for them.
Json toJson(const verify::HardCase& c, const std::vector<verify::Measurement>& measured)
{
    Json all = Json::array();
    for (const verify::Measurement& m : measured) {
        Json& entry = all.emplace_back(Json{{"what", m.what},
                                            {"value", std::isfinite(m.value) ? Json(m.value) : Json()},
                                            {"bound", boundName(m.bound)},
                                            {"limit", m.limit},
                                            {"holds", m.holds()}});
        if (m.bound == verify::Bound::within) entry["reference"] = m.reference;
    }
    Json row = {{"row", c.row}, {"id", c.id}, {"case", c.title}, {"usual", c.usual}, {"measured", all}};
    if (*c.reference) row["reference"] = c.reference;
    return row;
}

void printCase(const verify::HardCase& c, const std::vector<verify::Measurement>& measured)
{
    std::printf("%2d  %s%s\n", c.row, c.title, c.measure ? "" : ": not there yet");
    for (const verify::Measurement& m : measured)
        std::printf("    %-6s %10s  %-11s  %s\n", m.holds() ? "holds" : "FAILS", numberText(m.value).c_str(),
                    boundText(m).c_str(), m.what.c_str());
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
    const auto isNamed = [&](const verify::HardCase& c) {
        return std::find(options.only.begin(), options.only.end(), c.id) != options.only.end();
    };
    const Table mine = chosenTable(options);
    for (const Table& other : tables())
        for (const verify::HardCase& c : other.cases)
            if (other.cases.data() != mine.cases.data() && isNamed(c))
                throw InputError({"--only", std::string(c.id) + " goes with --" + other.name, "", ""});
    std::vector<verify::HardCase> chosen;
    std::copy_if(mine.cases.begin(), mine.cases.end(), std::back_inserter(chosen),
                 [&](const verify::HardCase& c) { return options.only.empty() || isNamed(c); });
    return chosen;
}

int run(const VerifyOptions& options)
{
    const ThreadLimit limit(options.threads);
    if (options.random.scenes > 0) return runRandom(options.random, {options.json, options.common.quiet});
    Json all = {{"program", "vdbfrac"},
                {"version", core::kVersion},
                {"table", chosenTable(options).name},
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
    std::printf("%s %s, %d %s not%s\n", counted(holding, "case").c_str(), holding == 1 ? "holds" : "hold", failing,
                failing == 1 ? "does" : "do",
                missing > 0 ? (", " + std::to_string(missing) + " not there yet").c_str() : "");
    if (!options.json.empty()) writeText(options.json, all.dump(1) + "\n");
    return failing == 0 ? kDone : kNotConverged;
}

}  // namespace

Action addVerify(CLI::App& app)
{
    std::vector<std::string> ids;
    for (const Table& table : tables())
        for (const verify::HardCase& c : table.cases) ids.push_back(c.id);
    auto o = std::make_shared<VerifyOptions>();
    CLI::App* c = app.add_subcommand(
        "verify", "Measure the program's accuracy and robustness against its limits; exits with 3 if one is missed");
    CLI::Option_group* which = c->add_option_group("Which");
    which->require_option(1);
    which->add_flag("--hard", o->hard, "The hard cases of the simulation");
    which->add_flag("--torture", o->torture, "Hard cases while something tears");
    which->add_flag("--newtons", o->newtons, "Stiffness, loads, energies and cracks against references");
    CLI::Option* random = which->add_option("--random", o->random.scenes, "Random scenes, this many")
                              ->check(CLI::Range(1, 1000000))
                              ->type_name("N");
    c->add_option("--seed", o->random.seed, "Seed of the first random scene; the others count on from it")
        ->capture_default_str()
        ->needs(random);
    c->add_option("--keep", o->random.keep, "Write random scenes that break a law into this folder")
        ->type_name("DIR")
        ->needs(random);
    c->add_flag("--quick", o->quick, "Use shorter runs where a case has a long one, as the tests do")->excludes(random);
    c->add_option("--only", o->only, "Which cases")
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
