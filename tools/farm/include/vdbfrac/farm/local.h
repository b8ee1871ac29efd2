// Runs of a wedge as processes of this machine.
#pragma once

#include <vdbfrac/farm/wedge.h>

#include <functional>

namespace vdbfrac::farm {

struct LocalSettings {
    std::filesystem::path folder;        ///< of the wedge
    int sideBySide = 1;                  ///< runs at a time
    int threads = 1;                     ///< of each
    std::vector<std::string> arguments;  ///< more options of 'vdbfrac sim'
    /// The signal to stop with, 0: go on. Asked several times a second.
    std::function<int()> stop;
    std::function<void(const std::string& line)> say;
};

/// The command that simulates a run, or goes on with it; the run stops when this process ends.
std::vector<std::string> simCommand(const LocalSettings& settings, const WedgeRun& run);

/// Simulates a run here and hands a signal on to it. Returns its exit code.
int runOne(const LocalSettings& settings, const WedgeRun& run);

/// Simulates all runs that are not done. Returns 0, or the exit code of the first that failed, or the code for stopped
/// runs where any stopped.
int runHere(const Wedge& wedge, const LocalSettings& settings);

}  // namespace vdbfrac::farm
