#include "slurm_options.h"

#include "stop_request.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/forecast/forecast.h>
#include <vdbfrac/lab/machine/memory.h>

#include <algorithm>

namespace vdbfrac::cli {

void addSlurmOptions(CLI::App& command, CLI::App& how, SlurmOptions& options)
{
    how.add_flag("--slurm", options.use, "Hand the runs to Slurm as an array job");
    command
        .add_option(
            "--time", options.time,
            "With --slurm: wall time of a task, as 4h or 2-12:00:00 (default: three times what is forecast); a run of "
            "a wedge is stopped with a checkpoint before, and queued again")
        ->type_name("TIME");
    command.add_option("--memory", options.memory, "With --slurm: MiB of a task (default: by its size)")
        ->check(CLI::Range(1, 100'000'000))
        ->type_name("MIB");
    command
        .add_option("--sbatch", options.sbatch,
                    "With --slurm: a further option of sbatch, as --sbatch=--partition=long")
        ->type_name("OPTION")
        ->allow_extra_args(false);
}

namespace {

constexpr double kMoreTime = 3, kPages = 600;  // s

/// s; 0 where there is no forecast.
double forecastOf(const scene::Scene& scene, const core::SceneEstimate& estimate, int threads)
{
    constexpr double kMeasured = 4;  // s
    try {
        const ThreadLimit limit(threads);
        return lab::forecast(scene, estimate, {kMeasured, lab::defaultMemoryLimit(), false}).seconds;
    } catch (const Error&) {
        return 0;
    }
}

/// Three times what is forecast, and what pages take; 0, the cluster's own limit, where nothing is.
double timeToAskFor(double forecast) { return forecast > 0 ? kMoreTime * forecast + kPages : 0; }

/// What goes with the time that a scene takes: nodes times steps.
double sizeOf(const scene::Scene& scene, const core::SceneEstimate& estimate)
{
    return estimate.nodes * double(scene.time.lastFrame - scene.time.firstFrame) * std::max(1, scene.time.substeps);
}

}  // namespace

double askFor(farm::SlurmJob& job, const SlurmOptions& options, const std::vector<const scene::Scene*>& scenes)
{
    // A quarter more than is estimated, and what pages and pictures take.
    constexpr double kMiB = 1024 * 1024, kMore = 1.25, kPictures = 256 * kMiB;
    const scene::Scene* longest = nullptr;
    core::SceneEstimate estimate;
    double bytes = 0;
    for (const scene::Scene* scene : scenes) {
        core::SceneEstimate own = core::estimateScene(*scene, lab::defaultMemoryLimit(), effects::bytesPerTet(*scene));
        bytes = std::max(bytes, own.bytes);
        if (!longest || sizeOf(*scene, own) > sizeOf(*longest, estimate)) longest = scene, estimate = std::move(own);
    }
    job.bytes = std::uint64_t(options.memory > 0 ? options.memory * kMiB : kMore * bytes + kPictures);
    const double forecast = longest ? forecastOf(*longest, estimate, job.threads) : 0;
    job.seconds = !options.time.empty() ? parseDuration("--time", options.time) : timeToAskFor(forecast);
    askForLast(job, forecast, 1);
    job.more = options.sbatch;
    return forecast;
}

void askForLast(farm::SlurmJob& job, double forecast, int sideBySide)
{
    job.last.bytes = std::uint64_t(sideBySide) * job.bytes;
    job.last.seconds = timeToAskFor(forecast);
}

}  // namespace vdbfrac::cli
