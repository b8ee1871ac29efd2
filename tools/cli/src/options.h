// What the commands share: options, and the log.
#pragma once

#include <CLI/CLI.hpp>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::cli {

/// Options of every command.
struct CommonOptions {
    bool verbose = false, quiet = false;
    std::string logFile;
    std::string progress = "auto";  ///< auto, bar, plain, none, openjd, alf
    /// The same, where nothing asked for any.
    std::string progressKind() const { return quiet && progress == "auto" ? "none" : progress; }
};
void addCommonOptions(CLI::App& command, CommonOptions& options);

/// Throws InputError where one of the files to write is one of those that are read, or that are written too, or of a
/// run.
void requireApart(const std::vector<std::filesystem::path>& outputs, const std::vector<std::filesystem::path>& others);

/// Log to stderr, and to files added later. stdout is for data.
std::shared_ptr<spdlog::logger> makeLog(const CommonOptions& options);
/// Adds to a log that is there. Throws InputError for another file.
void logToFile(spdlog::logger& log, const std::filesystem::path& file);

/// -j, 0 for all cores.
void addThreads(CLI::App& command, int& threads, const std::string& help = "Threads to use (default: all cores)");
/// --set KEY=VALUE, several times; what comes behind it is no value of it.
void addSet(CLI::App& command, std::vector<std::string>& set, const std::string& help);
/// --max-memory in GiB, 0 when it is not given. `what`: "the run".
void addMaxMemory(CLI::App& command, double& gibibytes, const std::string& what);
/// The limit in bytes that --max-memory asks for.
std::uint64_t memoryLimitOf(double gibibytes);

/// By its name, in any case.
bool isVdb(const std::filesystem::path& file);

}  // namespace vdbfrac::cli
