// What commands that hand an array job to Slurm have in common.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/farm/slurm.h>

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace vdbfrac::cli {

struct SlurmOptions {
    bool use = false;
    std::string time;   // of a task; empty: by a forecast
    double memory = 0;  // MiB of a task; 0: by its estimate
    std::vector<std::string> sbatch;
};

/// --slurm, into `how` (a group that it excludes others in, or the command), and --time, --memory, --sbatch.
void addSlurmOptions(CLI::App& command, CLI::App& how, SlurmOptions& options);

/// Fills in memory, wall time and the options that are passed on: what the largest of the tasks' scenes takes, by its
/// estimate, and by a forecast of the longest, which takes some seconds and is returned [s]; 0 where there is none.
double askFor(farm::SlurmJob& job, const SlurmOptions& options, const std::vector<const scene::Scene*>& scenes);
/// Memory and wall time of what is done when the tasks have ended and takes `forecast` [s]; 0: there is none.
void askForLast(farm::SlurmJob& job, double forecast, int sideBySide);

}  // namespace vdbfrac::cli
