#include <vdbfrac/lab/forecast/forecast.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/machine/scratch.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

namespace vdbfrac::lab {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMostTets = 2e6;        // of a scene that is made to be measured
constexpr double kFewestNodes = 300;     // of a pilot
constexpr double kMostWide = 16;         // voxels of a pilot
constexpr std::size_t kFewestSteps = 2;  // the first sets up
constexpr int kFirstSteps = 4;           // without the very first, which sets up
constexpr double kStatsBytes = 900;      // a row of stats.csv and of the records
constexpr double kCacheMisses = 1.5;     // a node of a large body costs that much more than one of a small one

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double mean(std::span<const double> values)
{
    return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.) / double(values.size());
}

/// A scene simulated for a while into a folder that goes away.
struct Sample {
    std::vector<double> cost;        // s, of each step
    std::vector<int> stepsIn;        // of each frame after the first that was done
    std::vector<double> frameBytes;  // of frames; the first is at rest, and its numbers are shorter
    double frameSeconds = 0;         // of the copy, the drawing and the wait for a frame
    double checkpointBytes = 0;
    double nodes = 0;
    bool isWhole = false;

    /// Of the steps at first, but for the very first.
    double firstCost() const
    {
        const std::size_t end = std::min<std::size_t>(cost.size(), 1 + kFirstSteps);
        return end > 1 ? mean(std::span(cost).subspan(1, end - 1)) : mean(cost);
    }
};

/// Until `seconds` or `maxSteps` are over. A frame is written at the start, at each frame's end, and at the end.
Sample take(const scene::Scene& scene, std::uint64_t memoryLimit, double seconds, int maxSteps)
{
    const Clock::time_point start = Clock::now();
    const ScratchFolder scratch;
    PreparedScene prepared(scene, memoryLimit);
    core::Simulation& simulation = prepared.simulation;
    core::RunFolder folder(scratch.path() / "run", scene, simulation, core::ExistingRun::refuse);
    Sample sample;
    sample.nodes = double(simulation.x().size());
    int frame = scene.time.firstFrame;
    folder.writeFrame(simulation, frame);
    const auto goesOn = [&] {
        return frame < scene.time.lastFrame && int(sample.cost.size()) < maxSteps &&
               (sample.cost.size() < kFewestSteps || since(start) < seconds);
    };
    while (goesOn()) {
        int steps = 0;
        for (; simulation.framesDone() < frame + 1 - scene.time.firstFrame && goesOn(); ++steps) {
            const Clock::time_point before = Clock::now();
            folder.addStep(simulation.stepInFrame());
            sample.cost.push_back(since(before));
        }
        folder.writeFrame(simulation, ++frame);
        if (simulation.framesDone() >= frame - scene.time.firstFrame) sample.stepsIn.push_back(steps);
    }
    sample.isWhole = simulation.framesDone() >= scene.time.lastFrame - scene.time.firstFrame;
    core::Archive archive;
    simulation.save(archive);
    sample.checkpointBytes = double(archive.byteCount());
    folder.finish(simulation, "forecast");
    for (const core::FrameRecord& f : folder.frames()) {
        double bytes = 0;
        for (const core::WrittenFile& file : f.files) bytes += double(file.bytes);
        sample.frameBytes.push_back(bytes);
    }
    const Ledger work = folder.work();
    double all = 0;
    for (const StageWork& stage : work.stages())
        if (stage.name != "output") all += stage.seconds;
    sample.frameSeconds = all / double(sample.frameBytes.size());
    return sample;
}

/// A frame once it moves.
double bytesOfFrame(const Sample& sample)
{
    return sample.frameBytes.size() > 1 ? sample.frameBytes[1] : sample.frameBytes[0];
}

/// Steps of all frames with voxels `finer` times as fine as in the sample, which may have ended early.
double stepsOf(const Sample& sample, const scene::Time& time, double finer)
{
    const double frames = time.lastFrame - time.firstFrame, atLeast = std::max(1, time.substeps);
    double steps = 0;
    for (const int n : sample.stepsIn) steps += atLeast + std::max(0., n - atLeast) * (time.substeps > 0 ? 1 : finer);
    const double done = double(sample.stepsIn.size());
    if (done == 0) return frames * std::max<double>(atLeast, double(sample.cost.size()));
    return steps * frames / done;
}

/// A sample of the scene on voxels so wide that all of it can be simulated in `seconds`, if a step of it costs `cost`
/// s; on still wider ones if that was too much. Which is told beside it.
std::optional<std::pair<Sample, double>> pilotOf(const scene::Scene& scene, const ForecastSettings& settings,
                                                 double nodes, double cost)
{
    constexpr double kFiner = 1.5, kTears = 3;  // steps a frame, and they cost more
    const double frames = scene.time.lastFrame - scene.time.firstFrame, seconds = 0.4 * settings.seconds;
    std::optional<std::pair<Sample, double>> pilot;
    for (double wider = kFiner; wider <= kMostWide && nodes / std::pow(wider, 3) > kFewestNodes; wider *= kFiner) {
        if (kTears * frames * cost / std::pow(wider, 3) > seconds) continue;
        scene::Scene coarse = scene;
        coarse.grid.voxelSize *= wider;
        try {
            const bool isSecond = pilot.has_value();
            Sample sample = take(coarse, settings.memoryLimit, seconds, std::numeric_limits<int>::max());
            if (!pilot || sample.stepsIn.size() > pilot->first.stepsIn.size()) pilot.emplace(std::move(sample), wider);
            if (isSecond || pilot->first.isWhole) break;
        } catch (const Error&) {  // too coarse for its bodies or grips
            break;
        }
    }
    return pilot;
}

/// What a forecast is made from: one of them at least.
struct Samples {
    std::optional<Sample> own;
    std::optional<std::pair<Sample, double>> pilot;  // and how much wider its voxels are
};

Samples samplesOf(const scene::Scene& scene, const core::SceneEstimate& estimate, const ForecastSettings& settings)
{
    constexpr double kSecondsOfNode = 1e-5;  // a step, at a guess: what to try first
    constexpr int kAll = std::numeric_limits<int>::max();
    const double frames = scene.time.lastFrame - scene.time.firstFrame;
    Samples s;
    if (estimate.tets <= kMostTets) s.own = take(scene, settings.memoryLimit, 0.2 * settings.seconds, 1 + kFirstSteps);
    if (settings.wider > 0) {
        scene::Scene coarse = scene;
        coarse.grid.voxelSize *= settings.wider;
        s.pilot.emplace(take(coarse, settings.memoryLimit, settings.seconds, kAll), settings.wider);
        return s;
    }
    const double cost = s.own ? s.own->firstCost() : kSecondsOfNode * estimate.nodes;
    // Small scenes are simulated themselves, as far as it goes.
    if (s.own && !s.own->isWhole && 2 * frames * cost < settings.seconds)
        s.own = take(scene, settings.memoryLimit, 0.8 * settings.seconds, kAll);
    if (!s.own || !(s.own->isWhole || double(s.own->stepsIn.size()) > 0.5 * frames))
        s.pilot = pilotOf(scene, settings, s.own ? s.own->nodes : estimate.nodes, cost);
    if (!s.own && !s.pilot) throw LimitError("the scene is too large to be measured, and too thin for wider voxels");
    return s;
}

}  // namespace

Forecast forecast(const scene::Scene& scene, const core::SceneEstimate& estimate, const ForecastSettings& settings)
{
    const auto [own, pilot] = samplesOf(scene, estimate, settings);
    const Sample& whole = pilot ? pilot->first : *own;
    const double frames = scene.time.lastFrame - scene.time.firstFrame;
    const double ofNode = (own ? own->nodes : estimate.nodes) / whole.nodes;
    Forecast result;
    result.wider = pilot ? pilot->second : 1;
    result.measuredSteps = own ? int(own->cost.size()) : 0;
    result.simulatedShare = frames > 0 ? double(whole.stepsIn.size()) / frames : 1;
    result.steps = stepsOf(whole, scene.time, result.wider);
    const double cost = own ? own->firstCost() : whole.firstCost() * kCacheMisses * ofNode;
    const double slower = whole.cost.empty() ? 1 : mean(whole.cost) / whole.firstCost();
    const double frameSeconds = own ? own->frameSeconds : whole.frameSeconds * ofNode;
    result.seconds = result.steps * cost * slower + (frames + 1) * frameSeconds;
    // What frames write is mostly surface.
    const double frameNow = own ? bytesOfFrame(*own) : bytesOfFrame(whole) * std::pow(ofNode, 2. / 3);
    result.frameBytes = frameNow * mean(whole.frameBytes) / std::max(1., bytesOfFrame(whole));
    const double one = own ? own->checkpointBytes : whole.checkpointBytes * ofNode;
    const double checkpoints = 1 + (settings.checkpointEvery > 0 ? std::ceil(frames / settings.checkpointEvery) : 1);
    result.checkpointBytes = one * (settings.keepsCheckpoints ? checkpoints : std::min(2., checkpoints));
    result.bytes = result.frameBytes * (frames + 1) + result.checkpointBytes + kStatsBytes * result.steps;
    return result;
}

}  // namespace vdbfrac::lab
