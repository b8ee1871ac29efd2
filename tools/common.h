// What the commands share: exit codes, the options every command has, the log.
#pragma once

#include <CLI/CLI.hpp>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace vdbfrac::tools {

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

/// Options of every command.
struct CommonOptions {
    bool verbose = false, quiet = false;
    std::string logFile;
    std::string progress = "auto";  ///< auto, bar, plain, none
};
void addCommonOptions(CLI::App& command, CommonOptions& options);

/// Log to stderr, and to files added later. stdout is for data.
std::shared_ptr<spdlog::logger> makeLog(const CommonOptions& options);
void logToFile(spdlog::logger& log, const std::filesystem::path& file);

/// -j, 0 for all cores.
void addThreads(CLI::App& command, int& threads, const std::string& help = "Threads to use (default: all cores)");
/// --max-memory in GiB, 0 when it is not given. `what`: "the run".
void addMaxMemory(CLI::App& command, double& gibibytes, const std::string& what);
/// The limit in bytes that --max-memory asks for.
std::uint64_t memoryLimitOf(double gibibytes);

/// By its name, in any case.
bool isVdb(const std::filesystem::path& file);

/// A command: what it does when it was the one that was asked for.
using Action = std::function<int()>;

Action addSim(CLI::App& app);
Action addCheck(CLI::App& app);
Action addScene(CLI::App& app);
Action addMesh(CLI::App& app);
Action addPreview(CLI::App& app);
Action addBench(CLI::App& app);
Action addRelevel(CLI::App& app);
Action addInfo(CLI::App& app);
Action addVerify(CLI::App& app);
Action addStudy(CLI::App& app);

}  // namespace vdbfrac::tools
