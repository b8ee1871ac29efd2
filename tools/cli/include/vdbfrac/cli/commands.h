// The commands of the program.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace vdbfrac::cli {

/// Documented in README.md and docs/commands.md.
enum ExitCode {
    kDone = 0,
    kInternal = 1,
    kBadInput = 2,      ///< command line, scene or input data
    kNotConverged = 3,  ///< under --strict, or all settings of a study
    kBadFile = 4,       ///< files and disk
    kLimit = 5,         ///< memory or another limit
    kStopped = 75,      ///< stopped with a checkpoint: run again with --resume
};

/// What is said where memory ends.
inline constexpr const char* kOutOfMemory = "out of memory; use a coarser grid.voxel_size";

/// A command: what it does when it was the one that was asked for.
using Action = std::function<int()>;

Action addSim(CLI::App& app);
Action addCheck(CLI::App& app);
Action addScene(CLI::App& app);
Action addMesh(CLI::App& app);
Action addPreview(CLI::App& app);
Action addEmbed(CLI::App& app);
Action addBench(CLI::App& app);
Action addRelevel(CLI::App& app);
Action addInfo(CLI::App& app);
Action addVerify(CLI::App& app);
Action addStudy(CLI::App& app);
Action addCalibrate(CLI::App& app);
Action addReport(CLI::App& app);
Action addWedge(CLI::App& app);

}  // namespace vdbfrac::cli
