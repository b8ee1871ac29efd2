#include "verify_random.h"

#include "options.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/verify/random_scene.h>
#include <vdbfrac/lab/verify/scene_laws.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace vdbfrac::cli {

namespace verify = lab::verify;

namespace {

using Json = nlohmann::ordered_json;
using verify::SceneOutcome;

constexpr int kEachCompared = 10;  // every tenth scene also runs on one thread and on two

struct Totals {
    int refused = 0, broken = 0, cutShort = 0, steps = 0, converged = 0, cutback = 0, capped = 0, torn = 0;
    double solveGain = 0, recutGain = 0, seconds = 0, slowest = 0;

    void add(const SceneOutcome& o)
    {
        refused += o.refused, broken += !o.broken.empty(), cutShort += o.cutShort, torn += o.volume < o.startVolume;
        steps += o.steps, converged += o.converged, cutback += o.cutback, capped += o.capped;
        solveGain = std::max(solveGain, o.solveGain), recutGain = std::max(recutGain, o.recutGain);
        seconds += o.seconds, slowest = std::max(slowest, o.seconds);
    }
};

Json toJson(std::uint64_t seed, const SceneOutcome& o)
{
    Json json = {{"seed", seed},
                 {"steps", o.steps},
                 {"converged", o.converged},
                 {"cutback", o.cutback},
                 {"capped", o.capped},
                 {"cut_short", o.cutShort},
                 {"start_volume", o.startVolume},
                 {"volume", o.volume},
                 {"solve_gain", o.solveGain},
                 {"recut_gain", o.recutGain},
                 {"seconds", o.seconds}};
    if (!o.broken.empty()) json["broken"] = o.broken;
    if (o.refused) json["refused"] = o.refusal;
    return json;
}

void keep(const std::filesystem::path& folder, std::uint64_t seed, const SceneOutcome& outcome,
          const std::string& scene)
{
    std::filesystem::create_directories(folder);
    writeText(folder / ("random_" + std::to_string(seed) + ".toml"),
              "# Breaks a law: " + outcome.broken + "\n" + scene);
}

void print(const RandomOptions& options, const Totals& t)
{
    std::printf("scenes      %d, seeds %llu to %llu: %d tear, %d were refused, %d were cut short by their work\n",
                options.scenes, static_cast<unsigned long long>(options.seed),
                static_cast<unsigned long long>(options.seed + std::uint64_t(options.scenes) - 1), t.torn, t.refused,
                t.cutShort);
    std::printf("steps       %d: %d converged, %d after halving dt, %d did not\n", t.steps, t.converged, t.cutback,
                t.capped);
    std::printf("energy      rose by at most %.2g of its turnover in a step, where compressed material turned\n",
                t.solveGain);
    std::printf("            rose by at most %.2g of its turnover in a cut, where mean dilatation had averaged it\n",
                t.recutGain);
    std::printf("time        %.1f s, the slowest scene %.1f s\n", t.seconds, t.slowest);
    std::printf("%d scenes break a law\n", t.broken);
}

}  // namespace

int runRandom(const RandomOptions& options, const RandomOutput& output)
{
    Totals totals;
    Json all = {{"program", "vdbfrac"}, {"version", core::kVersion}, {"seed", options.seed}, {"scenes", Json::array()}};
    for (int n = 0; n < options.scenes; ++n) {
        const std::uint64_t seed = options.seed + std::uint64_t(n);
        const std::string scene = verify::randomScene(seed);
        const SceneOutcome outcome = verify::runUnderLaws(scene, n % kEachCompared == 0);
        totals.add(outcome);
        all["scenes"].push_back(toJson(seed, outcome));
        if (!outcome.broken.empty() && !options.keep.empty()) keep(options.keep, seed, outcome, scene);
        if (output.quiet) continue;
        if (!outcome.broken.empty())
            std::printf("seed %llu breaks a law: %s\n", static_cast<unsigned long long>(seed), outcome.broken.c_str());
        if (outcome.refused)
            std::printf("seed %llu is refused: %s\n", static_cast<unsigned long long>(seed), outcome.refusal.c_str());
        std::fflush(stdout);
    }
    print(options, totals);
    if (!output.json.empty()) writeText(output.json, all.dump(1) + "\n");
    return totals.broken == 0 ? kDone : kNotConverged;
}

}  // namespace vdbfrac::cli
