// The notched block that ships, torn at a resolution: every stage of a real run with its time and its work.
#include "notched_block.h"

#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/machine/scratch.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace vdbfrac::lab::bench {

namespace {

/// The steps of one part of the run: all of them, or those in which something tore.
struct Part {
    int steps = 0;
    double seconds = 0;  // by the clock: also what no stage accounts for
    Ledger work;

    void add(double stepSeconds, const Ledger& stepWork)
    {
        ++steps;
        seconds += stepSeconds;
        work.add(stepWork);
    }

    Json toJson() const
    {
        Json stages = Json::array();
        for (const StageWork& s : work.stages())
            stages.push_back(
                {{"stage", s.name}, {"seconds_a_step", s.seconds / std::max(1, steps)}, {"work", s.counts}});
        return {{"steps", steps}, {"seconds_a_step", seconds / std::max(1, steps)}, {"stages", stages}};
    }
};

class Tearing {
public:
    explicit Tearing(const TearSize& size)
        : size_(size),
          prepared_(notchedBlock(size.voxels, size.lastFrame)),
          simulation_(prepared_.simulation),
          folder_(scratch_.path() / "run", prepared_.scene, simulation_, core::ExistingRun::refuse)
    {
    }

    /// Steps and writes frames until enough has torn. A frame is written when its time has come, as in any run.
    void run()
    {
        for (int frame = 1; frame <= size_.lastFrame && !done(); ++frame) {
            while (simulation_.framesDone() < frame - 1 && !done()) step();
            if (!done()) (void)folder_.writeFrame(simulation_, frame);
        }
        folder_.finish(simulation_, "finished");
    }

    Json toJson(std::uint64_t memoryBefore) const
    {
        const auto sum = [&](const char* count) { return all_.work.countOf("solve", count); };
        Part whole = all_;
        const Ledger output = folder_.work();
        whole.work.add(output);
        whole.seconds += output.secondsOf("snapshot") + output.secondsOf("wait");
        return {{"voxels", size_.voxels},
                {"threads", threadCount()},
                {"steps", all_.steps},
                {"frames", folder_.frames().size()},
                {"simulated_seconds", simulation_.time()},
                {"nodes", simulation_.x().size()},
                {"tets", simulation_.elastic().tetCount()},
                {"fragments", simulation_.fragments()},
                {"newton_iterations", sum("newton_iterations")},
                {"linear_iterations", sum("linear_iterations")},
                {"state_hash", hexadecimal(simulation_.stateHash())},
                {"memory_before_bytes", memoryBefore},
                {"peak_memory_bytes", peakMemory()},
                {"all_steps", whole.toJson()},
                {"tearing_steps", torn_.toJson()}};
    }

private:
    bool done() const { return torn_.steps >= size_.tornSteps; }

    void step()
    {
        const auto start = std::chrono::steady_clock::now();
        const core::StepRecord record = simulation_.stepInFrame();
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        folder_.addStep(record);
        all_.add(seconds, record.work);
        if (record.work.countOf("cut", "cells") > 0) torn_.add(seconds, record.work);
    }

    TearSize size_;
    PreparedScene prepared_;
    core::Simulation& simulation_;
    ScratchFolder scratch_;
    core::RunFolder folder_;
    Part all_, torn_;
};

}  // namespace

Json benchTear(const TearSize& size, const Say& say)
{
    const std::uint64_t before = resetPeakMemory();
    Tearing tearing(size);
    tearing.run();
    Json result = tearing.toJson(before);
    say(fmt::format("tear {}^3: {} steps, {} of them tearing, {:.3f} s a step, peak memory {:.2f} GiB", size.voxels,
                    result["steps"].get<int>(), result["tearing_steps"]["steps"].get<int>(),
                    result["all_steps"]["seconds_a_step"].get<double>(),
                    result["peak_memory_bytes"].get<double>() / kGiB));
    return result;
}

}  // namespace vdbfrac::lab::bench
