// Signals and clocks that ask a run to stop between two steps.
#pragma once

#include <chrono>
#include <string>

namespace vdbfrac::cli {

/// From construction on SIGINT, SIGTERM and SIGUSR1 are heard instead of ending the program; a second SIGINT ends it
/// with 130. One at a time.
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

/// Seconds of "3h50m", "90m", "45s" or "2h". Throws InputError.
double parseDuration(const std::string& option, const std::string& text);

}  // namespace vdbfrac::cli
