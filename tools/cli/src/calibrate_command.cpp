// vdbfrac calibrate: A of docs/physics.md, from cracks that run through strips.
#include "options.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/verify/calibration.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>

namespace vdbfrac::cli {

namespace verify = lab::verify;

namespace {

using Json = nlohmann::ordered_json;

constexpr double kRatios[] = {0, .3, .45};

struct CalibrateOptions {
    std::vector<std::string> lattices = {"six", "five", "delaunay"}, drivers = {"tension", "full"};
    int cells = 20, threads = 0;
    std::string json;
};

/// JSON has no NaN: null stands for it.
Json toJson(double value) { return std::isfinite(value) ? Json(value) : Json(); }

int run(const CalibrateOptions& options)
{
    const ThreadLimit limit(options.threads);
    Json rows = Json::array();
    bool isWhole = true;
    std::printf("A = kappa l / G, strips %d cells high\n%-8s %-9s %5s  %12s %16s %6s\n", options.cells, "driver",
                "lattice", "nu", "by G", "by dissipated", "mean");
    for (const std::string& driver : options.drivers)
        for (const std::string& lattice : options.lattices)
            for (const double nu : kRatios) {
                const verify::Calibration c = verify::calibrate({lattice, driver, nu, options.cells});
                std::printf("%-8s %-9s %5g  %12.3f %16.3f %6.3f\n", driver.c_str(), lattice.c_str(), nu, c.byRelease,
                            c.byDissipated, c.mean());
                std::fflush(stdout);
                isWhole = isWhole && std::isfinite(c.mean());
                rows.push_back({{"driver", driver},
                                {"lattice", lattice},
                                {"nu", nu},
                                {"by_release", toJson(c.byRelease)},
                                {"by_dissipated", toJson(c.byDissipated)},
                                {"mean", toJson(c.mean())}});
            }
    const Json all = {{"program", "vdbfrac"}, {"version", core::kVersion}, {"cells", options.cells}, {"rows", rows}};
    if (!options.json.empty()) writeText(options.json, all.dump(1) + "\n");
    return isWhole ? kDone : kNotConverged;
}

}  // namespace

Action addCalibrate(CLI::App& app)
{
    auto o = std::make_shared<CalibrateOptions>();
    CLI::App* c = app.add_subcommand(
        "calibrate",
        "Measure the constant A of the law of fracture again; ends with 3 when a crack did not get through");
    c->add_option("--lattice", o->lattices, "Which lattices")
        ->delimiter(',')
        ->check(CLI::IsMember({"six", "five", "delaunay"}))
        ->type_name("NAME,...");
    c->add_option("--driver", o->drivers, "Which drivers")
        ->delimiter(',')
        ->check(CLI::IsMember({"tension", "full"}))
        ->type_name("NAME,...");
    c->add_option("--cells", o->cells, "Lattice cells, of the height of a strip")
        ->check(CLI::Range(8, 80))
        ->capture_default_str();
    c->add_option("--json", o->json, "Write the table to this file too")->type_name("FILE");
    addThreads(*c, o->threads);
    return [o] { return run(*o); };
}

}  // namespace vdbfrac::cli
