// The vdbfrac program: subcommands, and the only place where errors become messages and exit codes.
#include <vdbfrac/cli/commands.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/core/version.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <string>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::cli;

namespace {

std::string listOf(const std::map<std::string, Action>& actions)
{
    std::string names;
    for (const auto& [name, action] : actions) names += (names.empty() ? "" : ", ") + name;
    return names;
}

/// What is still to be written to stdout, on a full disk for example, fails here or never.
void requireWritten()
{
    std::cout.flush();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) || !std::cout)
        throw FileError("standard output", std::string("cannot be written: ") + std::strerror(errno ? errno : EIO));
}

/// The last first, as CLI11 wants them; it takes -.4 for an option, and -0.4 for a number.
std::vector<std::string> reversedArguments(int argc, char** argv)
{
    std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
    for (std::string& a : arguments)
        if (a.size() > 2 && a[0] == '-' && a[1] == '.' && std::isdigit(static_cast<unsigned char>(a[2])))
            a.insert(1, "0");
    if (!arguments.empty() && arguments[0] == "help") {  // of a command, or of all
        arguments.erase(arguments.begin());
        arguments.push_back("--help");
    }
    std::reverse(arguments.begin(), arguments.end());
    return arguments;
}

int run(int argc, char** argv)
{
    CLI::App app{"Tears soft solids: a scene goes in, sequences of .vdb and .obj come out.", "vdbfrac"};
    app.set_version_flag("--version", core::kCreator);
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 done, 1 internal error, 2 bad command line, scene or data, 3 not converged (sim --strict, or a\n"
        "frame that gets nowhere) or a limit missed (verify, calibrate, study), 4 files and disk, 5 memory or another\n"
        "limit, 75 stopped with a checkpoint (sim, wedge; continue with --resume).\n"
        "'vdbfrac COMMAND --help' tells more.");
    app.failure_message([](const CLI::App* all, const CLI::Error& e) {
        const std::vector<CLI::App*> command = all->get_subcommands();
        return std::string("vdbfrac: error: ") + e.what() + "\n    hint: 'vdbfrac " +
               (command.empty() ? "" : command.front()->get_name() + " ") + "--help' tells what there is\n";
    });
    std::map<std::string, Action> actions;
    actions["sim"] = addSim(app);
    actions["check"] = addCheck(app);
    actions["scene"] = addScene(app);
    actions["mesh"] = addMesh(app);
    actions["preview"] = addPreview(app);
    actions["embed"] = addEmbed(app);
    actions["bench"] = addBench(app);
    actions["relevel"] = addRelevel(app);
    actions["info"] = addInfo(app);
    actions["verify"] = addVerify(app);
    actions["study"] = addStudy(app);
    actions["calibrate"] = addCalibrate(app);
    actions["report"] = addReport(app);
    actions["wedge"] = addWedge(app);
    const bool isHelp = argc > 1 && argv[1] == std::string("help");
    if (const char* command = argc > 1 + isHelp ? argv[1 + isHelp] : "-";
        command[0] != '-' && !actions.contains(command))
        throw InputError({"vdbfrac", std::string("there is no command '") + command + "'", listOf(actions), ""});
    try {
        app.parse(reversedArguments(argc, argv));
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? kDone : kBadInput;
    }
    return actions.at(app.get_subcommands().front()->get_name())();
}

int complain(const char* what, int code)
{
    std::fprintf(stderr, "vdbfrac: error: %s\n", what);
    return code;
}

}  // namespace

int main(int argc, char** argv)
{
    std::signal(SIGCHLD, SIG_DFL);  // ignored, as some that start it leave it, runs would end unseen
    std::signal(SIGXFSZ, SIG_IGN);  // a limit of file sizes is an error of writing, as a full disk is
    try {
        const int code = run(argc, argv);
        requireWritten();
        return code;
    } catch (const InputError& e) {
        return complain(e.what(), kBadInput);
    } catch (const FileError& e) {
        return complain(e.what(), kBadFile);
    } catch (const LimitError& e) {
        return complain(e.what(), kLimit);
    } catch (const std::filesystem::filesystem_error& e) {
        const std::string file = e.path1().empty() ? "a file" : e.path1().string();
        return complain((file + ": " + e.code().message()).c_str(), kBadFile);
    } catch (const std::bad_alloc&) {
        return complain(kOutOfMemory, kLimit);
    } catch (const std::exception& e) {
        return complain((std::string("internal: ") + e.what()).c_str(), kInternal);
    }
}
