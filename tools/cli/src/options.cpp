#include "options.h"

#include "number_options.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/machine/memory.h>

#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <algorithm>
#include <cctype>
#include <fstream>

namespace vdbfrac::cli {

void addCommonOptions(CLI::App& command, CommonOptions& options)
{
    command.add_flag("-v,--verbose", options.verbose, "Say more: every step");
    command.add_flag("-q,--quiet", options.quiet, "Say only what went wrong");
    command.add_option("--log-file", options.logFile, "Write the log to this file too")->type_name("FILE");
    command
        .add_option("--progress", options.progress,
                    "How to show progress: a bar on a terminal, plain lines in a log; or as render managers read it")
        ->check(CLI::IsMember({"auto", "bar", "plain", "none", "openjd", "alf"}))
        ->capture_default_str();
}

void addThreads(CLI::App& command, int& threads, const std::string& help)
{
    constexpr int kMaxThreads = 1024;
    command.add_option("-j,--threads", threads, help)->check(CLI::Range(0, kMaxThreads))->type_name("N");
}

void addSet(CLI::App& command, std::vector<std::string>& set, const std::string& help)
{
    command.add_option("--set", set, help)->type_name("KEY=VALUE")->allow_extra_args(false);
}

void addMaxMemory(CLI::App& command, double& gibibytes, const std::string& what)
{
    command.add_option("--max-memory", gibibytes, "GiB " + what + " may use (default: 80 % of what is available)")
        ->check(PositiveFinite(kMaxGiB))
        ->type_name("GIB");
}

std::uint64_t memoryLimitOf(double gibibytes)
{
    return gibibytes > 0 ? std::uint64_t(gibibytes * lab::kGiB) : lab::defaultMemoryLimit();
}

std::shared_ptr<spdlog::logger> makeLog(const CommonOptions& options)
{
    auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
    sink->set_pattern("%v");
    sink->set_level(options.quiet ? spdlog::level::err : options.verbose ? spdlog::level::debug : spdlog::level::info);
    auto log = std::make_shared<spdlog::logger>("vdbfrac", sink);
    log->set_level(spdlog::level::debug);
    if (!options.logFile.empty()) logToFile(*log, options.logFile);
    return log;
}

void requireApart(const std::vector<std::filesystem::path>& outputs, const std::vector<std::filesystem::path>& others)
{
    std::error_code isNotThere;
    for (const std::filesystem::path& out : outputs)
        for (const std::filesystem::path& other : others)
            if (!out.empty() && std::filesystem::weakly_canonical(out, isNotThere) ==
                                    std::filesystem::weakly_canonical(other, isNotThere))
                throw InputError(
                    {out.string(),
                     other == out ? "is named twice, and would be overwritten" : "would overwrite " + other.string(),
                     "another name", ""});
    for (const std::filesystem::path& out : outputs)
        if (const std::filesystem::path run = out.empty() ? out : core::runOf(out); !run.empty())
            throw InputError(
                {out.string(), "would overwrite a file of the run in " + run.string(), "another name", ""});
}

namespace {

/// Does a file begin as ours do, with a date?
bool isLog(const std::filesystem::path& file)
{
    std::string begin(5, '\0');
    std::ifstream(file).read(begin.data(), std::streamsize(begin.size()));
    return begin[4] == '-' &&
           std::all_of(begin.begin(), begin.begin() + 4, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

void logToFile(spdlog::logger& log, const std::filesystem::path& file)
{
    std::error_code isNotThere;
    if (std::filesystem::is_regular_file(file) && std::filesystem::file_size(file, isNotThere) > 0 && !isLog(file))
        throw InputError({file.string(), "is no log that could be added to", "a new file, or a log", ""});
    if (const auto parent = file.parent_path(); !parent.empty() && !std::filesystem::is_directory(parent))
        throw FileError(file.string(), "cannot be written: its folder does not exist");
    std::shared_ptr<spdlog::sinks::basic_file_sink_mt> sink;
    try {
        sink = std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string());
    } catch (const spdlog::spdlog_ex& e) {
        throw FileError(file.string(), std::string("cannot be written: ") + e.what());
    }
    sink->set_pattern("%Y-%m-%d %H:%M:%S %-7l %v");
    log.sinks().push_back(sink);
    log.flush_on(spdlog::level::debug);  // what one watches, and what is left of a run that is killed
}

bool isVdb(const std::filesystem::path& file)
{
    std::string e = file.extension().string();
    std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return e == ".vdb";
}

}  // namespace vdbfrac::cli
