#include <vdbfrac/farm/local.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/machine/process.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <string>
#include <string_view>
#include <thread>

#include <unistd.h>

namespace vdbfrac::farm {

namespace fs = std::filesystem;

namespace {

constexpr int kStopped = 75;  // of 'vdbfrac sim': stopped with a checkpoint
constexpr std::chrono::milliseconds kLook{50};

/// What a log says went wrong: its last error, or else its last line.
std::string reasonIn(const fs::path& log)
{
    constexpr std::string_view kError = "vdbfrac: error: ", kBlank = " \n";
    std::string text = fs::exists(log) ? readText(log) : "";
    text.resize(text.find_last_not_of(kBlank) + 1);  // 0 where there is nothing else
    const std::size_t error = text.rfind(kError);
    const std::size_t begin = error != std::string::npos ? error + kError.size() : text.rfind('\n') + 1;
    return text.substr(begin, text.find('\n', begin) - begin);
}

/// The exit code of a run, where all were asked to stop: one that had not begun to listen is stopped all the same, and
/// has lost nothing. A terminal sends its signal to the runs too, another than we do.
int stopCode(int code, bool isAsked)
{
    constexpr int kBySignal = 128;
    const auto& signals = lab::kStopSignals;
    const bool isBySignal = std::find(signals.begin(), signals.end(), code - kBySignal) != signals.end();
    return isAsked && isBySignal ? kStopped : code;
}

/// Runs in processes, and a signal for all of them.
class Runs {
public:
    Runs(const Wedge& wedge, const LocalSettings& settings) : wedge_(wedge), settings_(settings) {}

    int all()
    {
        std::size_t next = 0;
        while (true) {
            for (; next < wedge_.runs.size() && !signal_ && int(running_.size()) < settings_.sideBySide; ++next)
                begin(wedge_.runs[next]);
            if (running_.empty()) break;
            if (!collect()) std::this_thread::sleep_for(kLook);
            passSignal();
        }
        return failed_ ? failed_ : stopped_ || signal_ ? kStopped : 0;
    }

private:
    void begin(const WedgeRun& run)
    {
        if (isDone(statusOf(settings_.folder, run))) return say(run, "was done");
        keepFailure(settings_.folder, run, 0);
        running_.emplace(lab::startProgram(simCommand(settings_, run), logFile(settings_.folder, run), true), &run);
    }

    /// Takes note of a process that has ended; false when none has.
    bool collect()
    {
        for (const auto& [process, run] : running_) {
            int status = 0;
            if (!lab::hasEnded(process, status)) continue;
            passSignal();  // what has ended the run may be meant for all
            const int code = stopCode(lab::exitCodeOf(status), signal_ != 0);
            if (code == kStopped)
                stopped_ = true;
            else if (code != 0)
                failed_ = failed_ ? failed_ : code, keepFailure(settings_.folder, *run, code);
            say(*run, code == 0 ? statusOf(settings_.folder, *run)
                      : code == kStopped
                          ? "stopped; the same command goes on"
                          : fmt::format("ended with {}: {}", code, reasonIn(logFile(settings_.folder, *run))));
            running_.erase(process);
            return true;
        }
        return false;
    }

    void passSignal()
    {
        if (signal_ || !(signal_ = settings_.stop())) return;
        for (const auto& [process, run] : running_) kill(process, signal_);
    }

    void say(const WedgeRun& run, const std::string& what)
    {
        std::string values;
        for (std::size_t k = 0; k < run.values.size(); ++k)
            values += fmt::format("{}{} = {}", k > 0 ? ", " : "", wedge_.keys[k], run.values[k]);
        settings_.say(fmt::format("{}  {}: {}", run.name, values, what));
    }

    const Wedge& wedge_;
    const LocalSettings& settings_;
    std::map<pid_t, const WedgeRun*> running_;
    bool stopped_ = false;
    int failed_ = 0, signal_ = 0;
};

}  // namespace

std::vector<std::string> simCommand(const LocalSettings& settings, const WedgeRun& run)
{
    std::vector<std::string> command = {lab::ownProgram().string(),
                                        "sim",
                                        sceneFile(settings.folder, run).string(),
                                        "--output=" + (settings.folder / run.name).string(),
                                        "--resume",
                                        "--threads=" + std::to_string(settings.threads),
                                        "--parent=" + std::to_string(getpid()),
                                        "--progress=none"};
    command.insert(command.end(), settings.arguments.begin(), settings.arguments.end());
    return command;
}

int runOne(const LocalSettings& settings, const WedgeRun& run)
{
    keepFailure(settings.folder, run, 0);
    const pid_t process = lab::startProgram(simCommand(settings, run));
    int status = 0, passed = 0;
    for (; !lab::hasEnded(process, status); std::this_thread::sleep_for(kLook))
        if (const int signal = settings.stop(); signal != passed) kill(process, passed = signal);
    const int code = stopCode(lab::exitCodeOf(status), passed || settings.stop());
    if (code != kStopped) keepFailure(settings.folder, run, code);
    return code;
}

int runHere(const Wedge& wedge, const LocalSettings& settings) { return Runs(wedge, settings).all(); }

}  // namespace vdbfrac::farm
