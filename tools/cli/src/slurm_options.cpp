#include "slurm_options.h"

#include "stop_request.h"

#include <vdbfrac/base/error.h>
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
            "With --slurm: wall time of a task, as 4h (default: three times what is forecast); a run is stopped "
            "with a checkpoint before, and queued again")
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

/// Three times the forecast, and what pages take; 0, the cluster's own limit, where there is none.
double timeToAskFor(const scene::Scene& scene, const core::SceneEstimate& estimate, int threads)
{
    constexpr double kMore = 3, kPages = 600, kMeasured = 4;  // s
    try {
        const ThreadLimit limit(threads);
        return kMore * lab::forecast(scene, estimate, {kMeasured, lab::defaultMemoryLimit(), false}).seconds + kPages;
    } catch (const Error&) {
        return 0;
    }
}

}  // namespace

void askFor(farm::SlurmJob& job, const SlurmOptions& options, const std::vector<const scene::Scene*>& scenes)
{
    // A quarter more than is estimated, and what pages and pictures take.
    constexpr double kMiB = 1024 * 1024, kMore = 1.25, kPages = 256 * kMiB;
    const scene::Scene* largest = nullptr;
    core::SceneEstimate estimate;
    for (const scene::Scene* scene : scenes) {
        core::SceneEstimate own = core::estimateScene(*scene, lab::defaultMemoryLimit());
        if (!largest || own.bytes > estimate.bytes) largest = scene, estimate = std::move(own);
    }
    job.bytes = std::uint64_t(options.memory > 0 ? options.memory * kMiB : kMore * estimate.bytes + kPages);
    job.seconds = !options.time.empty() ? parseDuration("--time", options.time)
                  : largest             ? timeToAskFor(*largest, estimate, job.threads)
                                        : 0;
    job.more = options.sbatch;
}

}  // namespace vdbfrac::cli
