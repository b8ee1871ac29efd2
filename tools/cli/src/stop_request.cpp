#include "stop_request.h"

#include <vdbfrac/base/error.h>

#include <array>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>

#include <unistd.h>

namespace vdbfrac::cli {

namespace {

constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGUSR1};
constexpr std::array<const char*, 3> kNames = {"SIGINT", "SIGTERM", "SIGUSR1"};
constexpr int kExitInterrupted = 128 + SIGINT;

// A signal handler can reach nothing else.
volatile std::sig_atomic_t requested = 0, interrupted = 0;

extern "C" void hear(int signal)
{
    if (signal == SIGINT && interrupted) ::_exit(kExitInterrupted);
    interrupted = interrupted || signal == SIGINT;
    requested = signal;
}

}  // namespace

StopRequest::StopRequest(std::chrono::steady_clock::time_point start, double timeLimit)
    : start_(start), timeLimit_(timeLimit)
{
    interrupted = 0;
    requested = 0;
    for (int signal : kSignals)
        if (std::signal(signal, hear) == SIG_IGN) std::signal(signal, SIG_IGN);  // whoever started us wants it so
}

StopRequest::~StopRequest()
{
    for (int signal : kSignals) std::signal(signal, SIG_DFL);
}

std::string StopRequest::reason() const
{
    for (std::size_t i = 0; i < kSignals.size(); ++i)
        if (requested == kSignals[i]) return kNames[i];
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    return spent.count() > timeLimit_ ? "--time-limit" : "";
}

double parseDuration(const std::string& option, const std::string& text)
{
    double seconds = 0;
    const char *rest = text.data(), *const end = rest + text.size();
    for (const auto& [unit, size] : {std::pair{'h', 3600.}, {'m', 60.}, {'s', 1.}}) {
        double number = 0;
        const auto [after, error] = std::from_chars(rest, end, number);
        if (error == std::errc{} && after != end && *after == unit && number >= 0 && std::isfinite(number))
            seconds += number * size, rest = after + 1;
    }
    if (rest != end || !(seconds > 0))
        throw InputError(
            {option, "'" + text + "' is not a time", "hours, minutes and seconds, as 3h50m, 90m or 45s", ""});
    return seconds;
}

}  // namespace vdbfrac::cli
