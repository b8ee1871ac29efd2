// vdbfrac study: what accuracy costs. Error against time and work, for the settings of a scene's [study] or of the
// command line.
#include "options.h"
#include "slurm_options.h"
#include "stop_request.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/farm/slurm.h>
#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/machine/process.h>
#include <vdbfrac/lab/study/one_run.h>
#include <vdbfrac/lab/study/output.h>
#include <vdbfrac/lab/study/plan.h>
#include <vdbfrac/lab/study/runs.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numeric>
#include <thread>

#include <sys/time.h>
#include <unistd.h>

namespace vdbfrac::cli {

namespace bench = lab::bench;
namespace study = lab::study;

namespace {

namespace fs = std::filesystem;

struct StudyOptions {
    CommonOptions common;
    study::PlanInput plan;
    std::string folder, by;
    SlurmOptions slurm;
    int threads = 0, rounds = -1, run = -1, round = 0, parent = 0;
    bool threadsPerRun = false;
    double timeLimit = 0;  // s; 0: none
    double maxMemory = 0;  // GiB; 0: 80 % of what is available
};

/// Of version and code: results of another build are not reused.
std::string programFingerprint()
{
    const std::uint64_t version = hashBytes(core::kVersion, std::char_traits<char>::length(core::kVersion));
    return hexadecimal(hashFile("/proc/self/exe", version));
}

/// This program and what makes the same study again.
std::vector<std::string> ownCommand(const StudyOptions& o)
{
    std::vector<std::string> command = {lab::ownProgram().string(), "study", o.plan.scene.string(),
                                        "--output=" + o.folder};
    const auto add = [&](const char* option, const std::vector<std::string>& values) {
        for (const std::string& v : values) command.push_back(option + v);
    };
    add("--set=", o.plan.set);
    add("--vary=", o.plan.vary);
    add("--measure=", o.plan.measure);
    if (o.plan.grid) command.push_back("--grid");
    if (!o.by.empty()) command.push_back("--by=" + o.by);
    if (o.threadsPerRun) command.push_back("--threads-per-run");
    if (o.timeLimit > 0) command.push_back("--time-limit=" + std::to_string(o.timeLimit));
    if (o.maxMemory > 0) command.push_back("--max-memory=" + std::to_string(o.maxMemory));
    return command;
}

/// A number without a unit is one of seconds.
double timeLimitOf(const std::string& text)
{
    const bool isPlain = text.find_first_not_of("0123456789.") == std::string::npos;
    return parseDuration("--time-limit", isPlain ? text + "s" : text);
}

/// The process ends with SIGALRM then, whatever it is at.
void endAfter(double seconds)
{
    if (seconds <= 0) return;
    itimerval timer{};
    timer.it_value.tv_sec = time_t(seconds);
    timer.it_value.tv_usec = suseconds_t(std::max(1., 1e6 * (seconds - std::floor(seconds))));
    setitimer(ITIMER_REAL, &timer, nullptr);
}

/// A setting that cannot be simulated has a result too: why.
study::Result simulateGuarded(const scene::Scene& scene, std::span<const study::Spec::Measure> measures,
                              std::uint64_t limit)
{
    study::Result failed;
    try {
        return study::simulate(scene, measures, limit);
    } catch (const std::bad_alloc&) {
        failed.failure = "out of memory";
    } catch (const std::exception& e) {
        failed.failure = e.what();
    }
    return failed;
}

/// One run, in this process.
int runOne(const StudyOptions& o, const study::Study& plan)
{
    if (std::size_t(o.run) >= plan.runs.size())
        throw InputError(
            {"--run", "there is no run " + std::to_string(o.run), "0 to " + std::to_string(plan.runs.size() - 1), ""});
    const study::Run& run = plan.runs[std::size_t(o.run)];
    study::Result result = run.result;
    if (run.scene) {
        const ThreadLimit threads(std::max(1, o.threads));
        endAfter(o.timeLimit);
        const std::uint64_t limit = memoryLimitOf(o.maxMemory);
        result =
            simulateGuarded(*run.scene, o.round == 0 ? plan.spec.measures : std::vector<study::Spec::Measure>{}, limit);
    }
    result.fingerprint = run.fingerprint;
    result.peakBytes = lab::peakMemory();
    const fs::path file = study::resultFile(o.folder, run, o.round);
    fs::create_directories(file.parent_path());
    writeText(file, study::toJson(result).dump(2) + "\n");
    return kDone;
}

/// The scene with its settings in a file of its own: what is handed to a queue does not see it change. Throws
/// InputError where the folder has that of another.
fs::path keptScene(const StudyOptions& o)
{
    const fs::path copy = fs::path(o.folder) / "study.scene.toml";
    const scene::Scene scene = scene::readScene(o.plan.scene, study::vocabulary(), o.plan.set);
    const std::string text = scene::writeScene(scene, study::vocabulary());
    fs::create_directories(o.folder);
    if (fs::exists(copy) && readText(copy) != text)
        throw InputError({copy.string(), "is the scene of another study", "a new folder, or that of this study", ""});
    writeText(copy, text);
    return copy;
}

/// All runs as tasks of an array job; then the study itself, which uses their results and times them.
int runOnSlurm(StudyOptions o, const study::Study& plan)
{
    o.folder = fs::absolute(o.folder).string();
    o.plan.scene = keptScene(o).string();
    o.plan.set.clear();
    farm::SlurmJob job;
    job.name = plan.name;
    job.tasks.resize(plan.runs.size());
    std::iota(job.tasks.begin(), job.tasks.end(), 0);
    job.threads = std::max(1, o.threads);
    job.command = job.afterwards = ownCommand(o);
    job.command.push_back("--threads=" + std::to_string(job.threads));
    job.command.push_back("--run");
    job.afterwards.push_back("--rounds=" + std::to_string(plan.spec.rounds));
    job.afterwards.push_back("--threads=" + std::to_string(job.threads));
    job.goesOn = false;
    job.folder = o.folder;
    std::vector<const scene::Scene*> scenes;
    for (const study::Run& run : plan.runs)
        if (run.scene) scenes.push_back(&*run.scene);
    const double forecast = askFor(job, o.slurm, scenes);
    // The last job repeats failed runs side by side, then times all one after another, each on one thread where it has
    // not all of them.
    const int slower = o.threadsPerRun ? 1 : job.threads;
    askForLast(job, forecast * (1 + double(plan.runs.size()) * plan.spec.rounds * slower), job.threads);
    const std::string number = farm::submit(job);
    std::printf("job %s: %zu tasks; logs in %s/logs, table and plots in %s when all have ended\n", number.c_str(),
                job.tasks.size(), o.folder.c_str(), o.folder.c_str());
    return kDone;
}

std::size_t measureIndex(const study::Study& plan, const std::string& name)
{
    if (name.empty()) return 0;
    std::string names;
    for (std::size_t m = 0; m < plan.spec.measures.size(); ++m) {
        if (plan.spec.measures[m].name == name) return m;
        names += (m > 0 ? ", " : "") + plan.spec.measures[m].name;
    }
    throw InputError({"--by", "there is no measure '" + name + "'", "one of " + names, ""});
}

int runStudy(const StudyOptions& o, study::Study& plan)
{
    const auto log = makeLog(o.common);
    const std::size_t by = measureIndex(plan, o.by);
    const int threads = o.threads > 0 ? o.threads : int(std::max(1u, std::thread::hardware_concurrency()));
    const auto say = [&](const std::string& line) { log->info("{}", line); };
    const study::RunReport report = runAll(plan, {ownCommand(o), o.folder, threads, o.threadsPerRun, say});
    if (report.reused > 0)
        log->info("{} of {} runs reused, and {} rounds", report.reused, plan.runs.size(), report.reusedRounds);
    const study::Analysis analysis = study::analyse(plan, by);
    std::fputs(study::tableText(plan, analysis).c_str(), stdout);
    const fs::path folder = o.folder;
    writeText(folder / "study.csv", study::csvText(plan, analysis));
    writeText(folder / "study.json",
              study::jsonOf(plan, analysis, bench::describeMachine(o.threadsPerRun ? threads : 1)).dump(2) + "\n");
    writeText(folder / "study.svg", study::svgText(plan, analysis));
    log->info("written to {}", folder.string());
    for (const std::string& u : report.untimed) log->warn("not timed: {}", u);
    for (const std::string& d : report.differences) log->error("not the same again: {}", d);
    if (!report.differences.empty()) return kInternal;
    if (analysis.sound[analysis.base]) return kDone;
    log->error("no setting has a result: {}", study::reasonOf(plan, 0));
    return kNotConverged;
}

}  // namespace

Action addStudy(CLI::App& app)
{
    auto o = std::make_shared<StudyOptions>();
    CLI::App* c =
        app.add_subcommand("study", "Show what accuracy costs: error against time and work, over settings of a scene");
    c->add_option("SCENE", o->plan.scene, "Scene file (TOML), with [study] or with --vary")->required();
    c->add_option("-o,--output", o->folder, "Folder for the results (default: study_NAME)")->type_name("DIR");
    c->add_option("--vary", o->plan.vary,
                  "Values of a key, instead of the series of [study]; may be given several times")
        ->type_name("KEY=V1,V2,...")
        ->allow_extra_args(false);
    c->add_flag("--grid", o->plan.grid, "All combinations of what is varied");
    c->add_option("--measure", o->plan.measure,
                  "What to measure, instead of the measures of [study]; may be given several times")
        ->type_name("QUANTITY[:KEY=VALUE,...]")
        ->allow_extra_args(false);
    c->add_option("--by", o->by, "Measure that settings are marked and plotted by (default: the first)")
        ->type_name("MEASURE");
    addSet(*c, o->plan.set, "Change a key of the scene in all settings: key=value");
    c->add_option("--rounds", o->rounds, "How often each setting is timed (default: the scene's, or 5)")
        ->check(CLI::Range(0, 1000));
    addThreads(*c, o->threads, "Threads in all (default: all cores); with --run, of the run (default: 1)");
    c->add_flag("--threads-per-run", o->threadsPerRun,
                "One run at a time, on all threads; else side by side on one thread each");
    c->add_option_function<std::string>(
         "--time-limit", [o](const std::string& text) { o->timeLimit = timeLimitOf(text); },
         "How long a run may take, in seconds or as 10m")
        ->type_name("TIME");
    addMaxMemory(*c, o->maxMemory, "a run");
    addSlurmOptions(*c, *c, o->slurm);
    c->add_option("--run", o->run, "Only this run, in this process: writes its result into runs/")
        ->type_name("K")
        ->check(CLI::Range(0, 1000000));
    c->add_option("--round", o->round, "With --run: time it only, for this round")->type_name("R");
    c->add_option("--parent", o->parent)->group("");  // of runs that a study starts; hidden
    addCommonOptions(*c, o->common);
    return [o] {
        if (o->parent > 0) lab::endWithParent(o->parent);
        o->plan.program = programFingerprint();
        study::Study plan = study::makePlan(o->plan);
        if (o->folder.empty()) o->folder = "study_" + plan.name;
        if (o->rounds >= 0) plan.spec.rounds = o->rounds;
        return o->run >= 0 ? runOne(*o, plan) : o->slurm.use ? runOnSlurm(*o, plan) : runStudy(*o, plan);
    };
}

}  // namespace vdbfrac::cli
