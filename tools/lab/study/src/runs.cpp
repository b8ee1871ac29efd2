#include <vdbfrac/lab/study/runs.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/folder_lock.h>
#include <vdbfrac/lab/machine/process.h>
#include <vdbfrac/lab/study/one_run.h>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <limits>
#include <map>

#include <sys/wait.h>
#include <unistd.h>

namespace vdbfrac::lab::study {

namespace fs = std::filesystem;

namespace {

struct Job {
    std::size_t run;
    int round;  // 0: values; from 1: timing
    int threads;
};

std::optional<Result> readResult(const fs::path& file, const std::string& fingerprint)
{
    if (!fs::exists(file)) return {};
    try {
        Result r = resultOf(Json::parse(readText(file)));
        if (r.fingerprint == fingerprint) return r;
    } catch (const Json::exception&) {  // damaged, or of another version: it is made again
    }
    return {};
}

/// Starts this program anew; what it says goes to a file beside its result.
pid_t start(const Job& job, const fs::path& result, const RunSettings& settings)
{
    std::vector<std::string> arguments = settings.command;
    arguments.push_back("--run=" + std::to_string(job.run));
    arguments.push_back("--round=" + std::to_string(job.round));
    arguments.push_back("--threads=" + std::to_string(job.threads));
    arguments.push_back("--parent=" + std::to_string(getpid()));
    return startProgram(arguments, fs::path(result).replace_extension(".log"));
}

constexpr const char *kTooLong = "took longer than --time-limit", *kKilled = "killed; out of memory?";

/// Why a process left no result.
std::string deathOf(int status, const fs::path& log)
{
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return kTooLong;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) return kKilled;
    if (WIFSIGNALED(status)) return std::string("crashed: ") + strsignal(WTERMSIG(status));
    const std::string said = fs::exists(log) ? readText(log) : "";
    if (WEXITSTATUS(status) == 0) return "simulated another scene: was the scene changed while the study ran?";
    return "ended with " + std::to_string(WEXITSTATUS(status)) +
           (said.empty() ? "" : ": " + said.substr(0, said.find('\n')));
}

/// What the process of a run left in its file; a failure where it left nothing.
Result collect(const fs::path& file, int status, const std::string& fingerprint)
{
    const fs::path log = fs::path(file).replace_extension(".log");
    auto result = readResult(file, fingerprint);
    if (!result) {
        result.emplace();
        result->fingerprint = fingerprint;
        result->failure = deathOf(status, log);
        writeText(file, toJson(*result).dump(2) + "\n");
    }
    std::error_code none;
    if (fs::exists(log, none) && fs::file_size(log, none) == 0) fs::remove(log, none);
    return *result;
}

class Runner {
public:
    Runner(Study& study, const RunSettings& settings)
        : study_(study),
          settings_(settings),
          lock_(lockOf(settings.folder)),
          threads_(settings.threadsPerRun ? settings.threads : 1)
    {
        fs::create_directories(settings.folder / "runs");
    }

    RunReport run()
    {
        valueRuns();
        if (study_.spec.rounds > 0) compareThreads();
        for (int round = 1; round <= study_.spec.rounds; ++round) timeRound(round);
        return std::move(report_);
    }

private:
    /// Of a folder that is empty, or has what studies write. Others, as those of runs, stay as they are.
    static FolderLock lockOf(const fs::path& folder)
    {
        fs::create_directories(folder);
        FolderLock lock(folder);
        const auto has = [&](const char* name) { return fs::exists(folder / name); };
        if (!fs::is_empty(folder) && !has("runs") && !has("study.scene.toml"))
            throw InputError(
                {folder.string(), "is not empty and holds no study", "a new folder, or that of a study", ""});
        return lock;
    }
    static bool mayRun(const Run& run) { return run.scene.has_value(); }
    fs::path fileOf(std::size_t run, int round) const { return resultFile(settings_.folder, study_.runs[run], round); }

    /// All runs that are not there yet, so many side by side.
    void valueRuns()
    {
        std::vector<Job> jobs;
        for (std::size_t k = 0; k < study_.runs.size(); ++k) {
            Run& run = study_.runs[k];
            if (!mayRun(run)) continue;
            const auto old = readResult(fileOf(k, 0), run.fingerprint);
            if (old && old->failure.empty()) {
                run.result = *old;
                ++report_.reused;
            } else {
                jobs.push_back({k, 0, threads_});
            }
        }
        const std::size_t side = settings_.threadsPerRun ? 1 : std::size_t(std::max(1, settings_.threads));
        perform(jobs, side, [&](const Job& job, const Result& result) { study_.runs[job.run].result = result; });
    }

    /// Runs jobs, at most so many at a time, and hands each result over as it comes.
    template <class Take>
    void perform(const std::vector<Job>& jobs, std::size_t side, const Take& take)
    {
        std::map<pid_t, Job> running;
        std::size_t next = 0, done = 0;
        while (done < jobs.size()) {
            for (; next < jobs.size() && running.size() < side; ++next) {
                const fs::path file = fileOf(jobs[next].run, jobs[next].round);
                fs::remove(file);
                running.emplace(start(jobs[next], file, settings_), jobs[next]);
            }
            int status = 0;
            const pid_t ended = waitpid(-1, &status, 0);
            if (ended < 0 && errno != EINTR) throw Error(std::string("waiting for a run: ") + std::strerror(errno));
            const auto it = running.find(ended);
            if (it == running.end()) continue;
            const Job job = it->second;
            running.erase(it);
            const Result result = collect(fileOf(job.run, job.round), status, study_.runs[job.run].fingerprint);
            take(job, result);
            say(job, result, ++done, jobs.size());
        }
    }

    static std::string nameOf(int round)
    {
        return round > 0 ? fmt::format("round {}", round) : std::string("other threads");
    }

    void say(const Job& job, const Result& result, std::size_t done, std::size_t all) const
    {
        if (!settings_.say) return;
        const std::string round = job.round == 0 ? "" : nameOf(job.round) + ", ";
        settings_.say(fmt::format("{}{} of {}: {}: {}", round, done, all, fmt::join(study_.runs[job.run].set, ", "),
                                  result.failure.empty() ? fmt::format("{:.3g} s", result.seconds) : result.failure));
    }

    /// What was computed again has to be the same, whatever the number of threads. What the machine did not let end
    /// has no time.
    void compare(const Job& job, const Result& again)
    {
        const Result& first = study_.runs[job.run].result;
        if (again.failure == kTooLong || again.failure == kKilled) {
            report_.untimed.push_back(fmt::format("run {}, {}: {}", job.run, nameOf(job.round), again.failure));
            return;
        }
        std::string what;
        if (again.failure != first.failure) what = "ended another way: " + again.failure;
        for (const auto& [name, n] : first.work)
            if (what.empty() && again.count(name) != n)
                what = name + " " + std::to_string(again.count(name)) + ", at first " + std::to_string(n);
        if (what.empty() && again.stateHash != first.stateHash) what = "another state at the end";
        if (what.empty()) return;
        report_.differences.push_back("run " + std::to_string(job.run) + ", " + std::to_string(again.threads) +
                                      " threads: " + what);
    }

    /// The cheapest run once more, on another number of threads.
    void compareThreads()
    {
        std::optional<std::size_t> cheapest;
        for (const std::size_t k : timed())
            if (!cheapest || study_.runs[k].result.totalWork() < study_.runs[*cheapest].result.totalWork())
                cheapest = k;
        if (!cheapest) return;
        const int other = threads_ == 1 ? 2 : 1;
        const Job job{*cheapest, kCheck, other};
        if (const auto old = readResult(fileOf(*cheapest, kCheck), study_.runs[*cheapest].fingerprint);
            old && old->threads == other)
            return compare(job, *old);
        perform({job}, 1, [&](const Job&, const Result& again) { compare(job, again); });
    }

    /// Runs that are compared: all whose steps were solved.
    std::vector<std::size_t> timed() const
    {
        std::vector<std::size_t> all;
        for (std::size_t k = 0; k < study_.runs.size(); ++k)
            if (mayRun(study_.runs[k]) && study_.runs[k].result.sound()) all.push_back(k);
        return all;
    }

    void timeRound(int round)
    {
        if (reuseRound(round)) return;
        std::vector<Job> jobs;
        for (const std::size_t k : timed()) jobs.push_back({k, round, threads_});
        if (jobs.empty()) return;
        // Each round begins with another run: the first pays for the caches that the last of the round before left.
        std::rotate(jobs.begin(), jobs.begin() + std::ptrdiff_t(std::size_t(round - 1) % jobs.size()), jobs.end());
        perform(jobs, 1, [&](const Job& job, const Result& again) { takeTime(job, again); });
    }

    void takeTime(const Job& job, const Result& again)
    {
        compare(job, again);
        Run& run = study_.runs[job.run];
        run.seconds.push_back(again.failure.empty() ? again.seconds : std::numeric_limits<double>::quiet_NaN());
        if (again.failure.empty()) run.result.peakBytes = again.peakBytes;
    }

    bool reuseRound(int round)
    {
        std::vector<Result> old;
        for (const std::size_t k : timed()) {
            const auto r = readResult(fileOf(k, round), study_.runs[k].fingerprint);
            if (!r || !r->failure.empty() || r->threads != threads_) return false;
            old.push_back(*r);
        }
        std::size_t i = 0;
        for (const std::size_t k : timed()) takeTime({k, round, threads_}, old[i++]);
        ++report_.reusedRounds;
        return true;
    }

    static constexpr int kCheck = -1;  // the round that compares threads

    Study& study_;
    const RunSettings& settings_;
    FolderLock lock_;
    int threads_;  // of a run
    RunReport report_;
};

}  // namespace

fs::path resultFile(const fs::path& folder, const Run& run, int round)
{
    const std::string name = run.fingerprint + (round > 0   ? ".round-" + std::to_string(round)
                                                : round < 0 ? ".threads"
                                                            : "");
    return folder / "runs" / (name + ".json");
}

RunReport runAll(Study& study, const RunSettings& settings) { return Runner(study, settings).run(); }

}  // namespace vdbfrac::lab::study
