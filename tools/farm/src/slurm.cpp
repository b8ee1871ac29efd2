#include <vdbfrac/farm/slurm.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/lab/machine/process.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

namespace vdbfrac::farm {

namespace fs = std::filesystem;

namespace {

std::string line(const std::vector<std::string>& command)
{
    std::string text = "exec";
    for (const std::string& word : command) text += " " + lab::quoted(word);
    return text;
}

/// "HH:MM:SS", at least two minutes: Slurm may send a signal a minute too early.
std::string clockText(double seconds)
{
    const long long s = std::max(120LL, std::llround(std::ceil(seconds)));
    return fmt::format("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

/// A value of a directive, which is split at spaces unless they are quoted.
std::string quotedValue(const std::string& value)
{
    std::string text = "\"";
    for (const char c : value) text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return text + "\"";
}

/// A path in which nothing is a number of the job or a name.
std::string literalPath(const fs::path& path)
{
    std::string text;
    for (const char c : path.string()) text += c == '%' ? std::string("%%") : std::string(1, c);
    return text;
}

std::string resources(int threads, std::uint64_t bytes, double seconds)
{
    constexpr double kMiB = 1024 * 1024;
    std::string text = fmt::format("#SBATCH --cpus-per-task={}\n", threads);
    if (bytes > 0) text += fmt::format("#SBATCH --mem={}M\n", std::llround(std::ceil(double(bytes) / kMiB)));
    if (seconds > 0) text += "#SBATCH --time=" + clockText(seconds) + "\n";
    return text;
}

/// Of a script, `own` ones among them; `log` may have numbers of the job. What the user gives comes last, since Slurm
/// takes the last of two.
std::string directives(const SlurmJob& job, const std::string& log, const std::string& own)
{
    std::string text = "#!/bin/bash\n#SBATCH --job-name=" + quotedValue(job.name) + "\n#SBATCH --open-mode=append\n";
    text += "#SBATCH --output=" + quotedValue(literalPath(job.folder / "logs") + "/" + log) + "\n" + own;
    for (const std::string& option : job.more) text += "#SBATCH " + option + "\n";
    return text;
}

std::string submitScript(const fs::path& script, const std::vector<std::string>& options)
{
    std::vector<std::string> command = {"sbatch", "--parsable"};
    command.insert(command.end(), options.begin(), options.end());
    command.push_back(script.string());
    const lab::Said said = lab::ask(command);
    if (said.code != 0)
        throw InputError({script.string(), "sbatch refuses it; it says why above", "",
                          "other --time, --memory or --sbatch; of more tasks than the cluster lets an array have "
                          "(scontrol show config: MaxArraySize), make several wedges"});
    return said.text.substr(0, said.text.find_first_of(";\n"));  // "NUMBER;CLUSTER"
}

/// The number of the last job of a folder.
fs::path jobFile(const fs::path& folder) { return folder / "logs" / "job"; }

/// Throws where that job is still in the queue: two would simulate the same runs.
void requireNoneQueued(const fs::path& folder)
{
    if (!fs::exists(jobFile(folder))) return;
    const std::string number = readText(jobFile(folder));
    lab::Said queued;
    try {
        queued = lab::ask({"squeue", "--me", "--noheader", "--format=%F"});  // numbers of arrays
    } catch (const FileError&) {
        return;  // nobody to ask
    }
    if (queued.code != 0)
        throw FileError("squeue", "does not tell whether job " + number + " is queued (exit code " +
                                      std::to_string(queued.code) + "): try again, or remove " +
                                      jobFile(folder).string() + " if it is not");
    std::istringstream lines(queued.text);
    for (std::string job; lines >> job;)
        if (job == number)
            throw InputError({folder.string(), "job " + number + " for it is queued or runs", "",
                              "wait until it has ended, or scancel " + number});
}

}  // namespace

std::string arrayScript(const SlurmJob& job)
{
    std::string own = "#SBATCH --array=" + rangesText(job.tasks, ",") + "\n";
    own += resources(job.threads, job.bytes, job.seconds) + "#SBATCH --requeue\n";
    if (job.goesOn) own += fmt::format("#SBATCH --signal=B:USR1@{}\n", job.warning);
    return directives(job, "%a.slurm.log", own) + line(job.command) + " \"$SLURM_ARRAY_TASK_ID\"\n";
}

std::string submit(const SlurmJob& job)
{
    fs::create_directories(job.folder / "logs");
    requireNoneQueued(job.folder);
    const fs::path array = job.folder / "array.sh", last = job.folder / "afterwards.sh";
    writeText(array, arrayScript(job));
    const std::string number = submitScript(array, {});
    writeText(jobFile(job.folder), number);
    if (!job.afterwards.empty()) {
        const std::string own = resources(job.threads, job.last.bytes, job.last.seconds);
        writeText(last, directives(job, "afterwards.slurm.log", own) + line(job.afterwards) + "\n");
        try {
            submitScript(last, {"--dependency=afterany:" + number});
        } catch (const InputError& e) {
            InputError::Detail d = e.details()[0];
            d.what += "; the job " + number +
                      " of the runs is queued: run what is in the script when it has ended, or scancel it";
            throw InputError({d});
        }
    }
    return number;
}

bool requeueThisTask()
{
    const char *job = std::getenv("SLURM_ARRAY_JOB_ID"), *task = std::getenv("SLURM_ARRAY_TASK_ID");
    if (!job || !task) return false;
    return lab::waitFor(lab::startProgram({"scontrol", "requeue", std::string(job) + "_" + task})) == 0;
}

}  // namespace vdbfrac::farm
