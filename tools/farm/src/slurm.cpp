#include <vdbfrac/farm/slurm.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/machine/process.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace vdbfrac::farm {

namespace fs = std::filesystem;

namespace {

std::string line(const std::vector<std::string>& command)
{
    std::string text = "exec";
    for (const std::string& word : command) text += " " + lab::quoted(word);
    return text;
}

/// "HH:MM:SS", at least a minute.
std::string clockText(double seconds)
{
    const long long s = std::max(60LL, std::llround(std::ceil(seconds)));
    return fmt::format("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

/// Of a script, `own` ones among them. What the user gives comes last, since Slurm takes the last of two.
std::string directives(const SlurmJob& job, const std::string& log, const std::string& own)
{
    std::string text = "#!/bin/bash\n#SBATCH --job-name=" + job.name + "\n#SBATCH --open-mode=append\n";
    text += "#SBATCH --output=" + (job.folder / "logs" / log).string() + "\n" + own;
    for (const std::string& option : job.more) text += "#SBATCH " + option + "\n";
    return text;
}

std::string submitScript(const fs::path& script, const std::vector<std::string>& options)
{
    std::vector<std::string> command = {"sbatch", "--parsable"};
    command.insert(command.end(), options.begin(), options.end());
    command.push_back(script.string());
    const lab::Said said = lab::ask(command);
    if (said.code != 0) throw Error("sbatch refused " + script.string() + " (it says why above)");
    return said.text.substr(0, said.text.find_first_of(";\n"));  // "NUMBER;CLUSTER"
}

}  // namespace

std::string arrayScript(const SlurmJob& job)
{
    constexpr double kMiB = 1024 * 1024;
    std::string own = fmt::format("#SBATCH --array=0-{}\n#SBATCH --cpus-per-task={}\n", job.tasks - 1, job.threads);
    if (job.bytes > 0) own += fmt::format("#SBATCH --mem={}M\n", std::llround(std::ceil(double(job.bytes) / kMiB)));
    if (job.seconds > 0) own += "#SBATCH --time=" + clockText(job.seconds) + "\n";
    own += fmt::format("#SBATCH --requeue\n#SBATCH --signal=B:USR1@{}\n", job.warning);
    return directives(job, "%a.slurm.log", own) + line(job.command) + " \"$SLURM_ARRAY_TASK_ID\"\n";
}

std::string submit(const SlurmJob& job)
{
    fs::create_directories(job.folder / "logs");
    const fs::path array = job.folder / "array.sh", last = job.folder / "afterwards.sh";
    writeText(array, arrayScript(job));
    const std::string number = submitScript(array, {});
    if (!job.afterwards.empty()) {
        writeText(last, directives(job, "afterwards.slurm.log", "") + line(job.afterwards) + "\n");
        submitScript(last, {"--dependency=afterany:" + number});
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
