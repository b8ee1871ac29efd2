#include <vdbfrac/lab/machine/process.h>

#include <vdbfrac/base/error.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace vdbfrac::lab {

namespace fs = std::filesystem;

namespace {

/// What a new process does with its files before it becomes the program.
class FileActions {
public:
    FileActions() { posix_spawn_file_actions_init(&actions_); }
    ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
    FileActions(const FileActions&) = delete;
    FileActions& operator=(const FileActions&) = delete;
    posix_spawn_file_actions_t* get() { return &actions_; }

private:
    posix_spawn_file_actions_t actions_;
};

pid_t start(const std::vector<std::string>& command, FileActions& actions)
{
    std::vector<char*> pointers;
    for (const std::string& word : command) pointers.push_back(const_cast<char*>(word.c_str()));
    pointers.push_back(nullptr);
    pid_t process = 0;
    const int error = posix_spawnp(&process, pointers[0], actions.get(), nullptr, pointers.data(), environ);
    if (error != 0) throw FileError(command[0], std::string("cannot be started: ") + std::strerror(error));
    return process;
}

}  // namespace

fs::path ownProgram() { return fs::read_symlink("/proc/self/exe"); }

pid_t startProgram(const std::vector<std::string>& command, const fs::path& log, bool append)
{
    FileActions actions;
    if (!log.empty()) {
        const int mode = O_WRONLY | O_CREAT | (append ? O_APPEND : O_TRUNC);
        posix_spawn_file_actions_addopen(actions.get(), 1, log.c_str(), mode, 0666);
        posix_spawn_file_actions_adddup2(actions.get(), 1, 2);
    }
    return start(command, actions);
}

void endWithParent(pid_t parent)
{
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) raise(SIGTERM);
}

int exitCodeOf(int status)
{
    constexpr int kBySignal = 128;
    return WIFSIGNALED(status) ? kBySignal + WTERMSIG(status) : WEXITSTATUS(status);
}

bool hasEnded(pid_t process, int& status)
{
    const pid_t ended = waitpid(process, &status, WNOHANG);
    if (ended < 0 && errno != EINTR) throw Error(std::string("waiting for a program: ") + std::strerror(errno));
    return ended == process;
}

int waitFor(pid_t process)
{
    int status = 0;
    while (waitpid(process, &status, 0) < 0)
        if (errno != EINTR) throw Error(std::string("waiting for a program: ") + std::strerror(errno));
    return exitCodeOf(status);
}

Said ask(const std::vector<std::string>& command)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw Error(std::string("a pipe: ") + std::strerror(errno));
    FileActions actions;
    posix_spawn_file_actions_adddup2(actions.get(), ends[1], 1);
    pid_t process = 0;
    try {
        process = start(command, actions);
    } catch (...) {
        close(ends[0]), close(ends[1]);
        throw;
    }
    close(ends[1]);
    Said said;
    std::array<char, 4096> buffer;
    for (ssize_t n = 0; (n = read(ends[0], buffer.data(), buffer.size())) != 0;) {
        if (n < 0 && errno != EINTR) break;
        if (n > 0) said.text.append(buffer.data(), std::size_t(n));
    }
    close(ends[0]);
    said.code = waitFor(process);
    return said;
}

std::string quoted(const std::string& word)
{
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

}  // namespace vdbfrac::lab
