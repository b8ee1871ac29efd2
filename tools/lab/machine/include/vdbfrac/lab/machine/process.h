// Programs that are started beside this one.
#pragma once

#include <array>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace vdbfrac::lab {

/// This program.
std::filesystem::path ownProgram();

/// Starts a program, found along PATH where its name has no slash, and does not wait for it. What it says goes to
/// `log`, which is emptied, or extended where `append` is set; without one to where this program's goes. Throws
/// FileError.
pid_t startProgram(const std::vector<std::string>& command, const std::filesystem::path& log = {}, bool append = false);

/// Signals that ask a run to stop: of users, of queues before they kill, of a terminal that is closed.
inline constexpr std::array kStopSignals = {SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGHUP, SIGXCPU};

/// Ends this process with SIGTERM when the one that started it ends, which may have happened already.
void endWithParent(pid_t parent);

/// Whether a program has ended, with its status then. Throws Error where nobody can know.
bool hasEnded(pid_t process, int& status);
/// Its exit code; 128 and the number of the signal that ended it.
int waitFor(pid_t process);
int exitCodeOf(int status);

/// What a program says on standard output, and its exit code. Throws FileError where it cannot be started.
struct Said {
    int code = 0;
    std::string text;
};
Said ask(const std::vector<std::string>& command);

/// As a shell reads it back.
std::string quoted(const std::string& word);

}  // namespace vdbfrac::lab
