// Runs of a wedge, or other numbered tasks, as an array job of Slurm.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::farm {

struct SlurmJob {
    std::string name;
    std::vector<std::size_t> tasks;       ///< their numbers, rising
    std::vector<std::string> command;     ///< the task's number comes behind
    std::vector<std::string> afterwards;  ///< once all tasks have ended; may be empty
    std::filesystem::path folder;         ///< for scripts and logs/
    int threads = 1;                      ///< of a task
    std::uint64_t bytes = 0;              ///< of memory of a task; 0: the cluster's
    double seconds = 0;                   ///< wall time of a task; 0: the cluster's
    bool goesOn = true;                   ///< a task is told to stop before that, and queued again
    int warning = 60;                     ///< s before it, in which a checkpoint is written
    struct {
        std::uint64_t bytes = 0;
        double seconds = 0;
    } last;                         ///< the same of what is done afterwards
    std::vector<std::string> more;  ///< further options of sbatch, as "--partition=long"
};

/// The script of an array job: each task becomes the command, so that signals reach it, and is queued again when it
/// was told to stop.
std::string arrayScript(const SlurmJob& job);

/// Writes array.sh (and afterwards.sh) and hands them to sbatch. Returns the number of the job. Throws FileError where
/// there is no sbatch, InputError where it refuses (it says why on stderr) or a job of the same folder is still queued.
std::string submit(const SlurmJob& job);

/// Of a task under Slurm that was told to stop: puts it into the queue again. False where this is no such task, or
/// Slurm refuses.
[[nodiscard]] bool requeueThisTask();

}  // namespace vdbfrac::farm
