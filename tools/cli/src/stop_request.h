// Signals and clocks that ask a run to stop between two steps.
#pragma once

#include <chrono>
#include <string>

namespace vdbfrac::cli {

/// From construction on SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGHUP and SIGXCPU are heard instead of ending the program,
/// but those that whoever started it ignores; a second SIGINT ends it with 130. One at a time.
class StopRequest {
public:
    /// `timeLimit` [s] counts from `start`; infinity for none.
    StopRequest(std::chrono::steady_clock::time_point start, double timeLimit);
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;
    StopRequest& operator=(const StopRequest&) = delete;

    /// Why the run is to stop; empty when it is not.
    std::string reason() const;

private:
    std::chrono::steady_clock::time_point start_;
    double timeLimit_;
};

/// While there is nothing that could be lost, the same signals (but SIGINT) end the program at once with the exit code
/// of a run that was stopped, until a StopRequest hears them.
void leaveOnSignals();

/// Seconds of "1d", "3h50m", "90m", "45s", "HH:MM:SS" or "D-HH:MM:SS". Throws InputError.
double parseDuration(const std::string& option, const std::string& text);

}  // namespace vdbfrac::cli
