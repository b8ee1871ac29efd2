#include "stop_request.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/lab/machine/process.h>

#include <array>
#include <charconv>
#include <cmath>
#include <csignal>
#include <regex>
#include <string_view>
#include <utility>

#include <unistd.h>

namespace vdbfrac::cli {

namespace {

constexpr const auto& kSignals = lab::kStopSignals;
constexpr std::array kNames = {"SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGHUP", "SIGXCPU"};
static_assert(kSignals.size() == kNames.size());
constexpr int kExitInterrupted = 128 + SIGINT;

// A signal handler can reach nothing else.
volatile std::sig_atomic_t requested = 0, interrupted = 0;

extern "C" void hear(int signal)
{
    if (signal == SIGINT && interrupted) ::_exit(kExitInterrupted);
    interrupted = interrupted || signal == SIGINT;
    requested = signal;
}

extern "C" void leave(int) { ::_exit(kStopped); }

/// But those that whoever started us wants to be ignored.
void handle(int signal, void (*handler)(int))
{
    if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

}  // namespace

void leaveOnSignals()
{
    for (int signal : kSignals)
        if (signal != SIGINT) handle(signal, leave);
}

StopRequest::StopRequest(std::chrono::steady_clock::time_point start, double timeLimit)
    : start_(start), timeLimit_(timeLimit)
{
    interrupted = 0;
    requested = 0;
    for (int signal : kSignals) handle(signal, hear);
}

StopRequest::~StopRequest()
{
    for (int signal : kSignals) handle(signal, SIG_DFL);
}

std::string StopRequest::reason() const
{
    for (std::size_t i = 0; i < kSignals.size(); ++i)
        if (requested == kSignals[i]) return kNames[i];
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    return spent.count() > timeLimit_ ? "--time-limit" : "";
}

namespace {

/// "1d", "3h50m", "45s"; takes what it can read off `text`.
double secondsInUnits(std::string_view& text)
{
    double seconds = 0;
    for (const auto& [unit, size] : {std::pair{'d', 86400.}, {'h', 3600.}, {'m', 60.}, {'s', 1.}}) {
        double number = 0;
        const char* const end = text.data() + text.size();
        const auto [after, error] = std::from_chars(text.data(), end, number);
        if (error == std::errc{} && after != end && *after == unit && number >= 0 && std::isfinite(number))
            seconds += number * size, text.remove_prefix(std::size_t(after + 1 - text.data()));
    }
    return seconds;
}

/// "HH:MM:SS" or "D-HH:MM:SS", as Slurm has it; takes all of `text` or nothing.
double secondsOnClock(std::string_view& text)
{
    static const std::regex form("(?:([0-9]{1,4})-)?([0-9]{1,5}):([0-5]?[0-9]):([0-5]?[0-9])");
    std::cmatch part;
    if (!std::regex_match(text.data(), text.data() + text.size(), part, form)) return 0;
    text = {};
    const auto number = [&](std::size_t i) { return part[i].matched ? std::stod(part[i].str()) : 0.; };
    return 86400 * number(1) + 3600 * number(2) + 60 * number(3) + number(4);
}

}  // namespace

double parseDuration(const std::string& option, const std::string& text)
{
    std::string_view rest = text;
    double seconds = secondsOnClock(rest);
    if (seconds == 0) seconds = secondsInUnits(rest);
    constexpr double kLongest = 1e9;  // more than 30 years
    if (!rest.empty() || !(seconds > 0 && seconds <= kLongest))
        throw InputError({option, "'" + text + "' is not a time above 0", "as 3h50m, 90m, 45s, 1d or 1-12:00:00",
                          "a number needs its unit"});
    return seconds;
}

}  // namespace vdbfrac::cli
