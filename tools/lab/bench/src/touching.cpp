// Two blocks that are pressed together: what contact takes of a step, and what it makes of linear systems.
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>

namespace vdbfrac::lab::bench {

namespace {

/// Blocks of n x n/4 x n voxels, the upper one pressed down on the other and along it; `contact` table.
std::string pressedBlocks(const TouchSize& size, const std::string& contact)
{
    const double dx = 1. / size.voxels, height = size.voxels / 4 * dx, middle = height / 2 + .1 * dx;
    std::string scene = fmt::format(
        "version = 1\nname = \"pressed\"\n[time]\nframes = [1, {}]\nsubsteps = 1\n[grid]\nvoxel_size = {}\n{}"
        "[material.gel]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n[damping]\nstiffness = 0.002\n",
        size.steps + 1, dx, contact);
    for (const double side : {-1., 1.}) {
        const char* name = side < 0 ? "lower" : "upper";
        scene += fmt::format(
            "[[body]]\nname = \"{}\"\nmaterial = \"gel\"\n"
            "shape = {{ box = {{ size = [1, {}, 1], center = [0, {}, 0] }} }}\n",
            name, height, side * middle);
        scene += fmt::format(
            "[[grip]]\nbody = \"{}\"\nregion = {{ halfspace = {{ normal = [0, {}, 0], offset = {} }} }}\n"
            "move = {{ velocity = [{}, {}, 0] }}\n",
            name, side, middle + height / 2 - 1.1 * dx, side < 0 ? 0 : .01, side < 0 ? 0 : -2 * dx);
    }
    return scene;
}

/// The steps in which blocks touch.
struct Touching {
    int steps = 0;
    double seconds = 0;
    std::size_t nodes = 0;
    Ledger work;

    Touching(const TouchSize& size, const std::string& contact)
    {
        SceneRun run(pressedBlocks(size, contact));
        nodes = run.simulation.x().size();
        while (!run.atEnd()) {
            const auto start = std::chrono::steady_clock::now();
            const core::StepRecord& record = run.step();
            if (!contact.empty() && record.work.countOf("solve", "couplings") == 0) continue;
            ++steps;
            seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            work.add(record.work);
        }
    }

    double aStep(const char* stage, const char* count) const { return double(work.countOf(stage, count)) / steps; }
    double iterationsASystem() const
    {
        return double(work.countOf("solve", "linear_iterations")) /
               double(std::max<std::int64_t>(1, work.countOf("solve", "newton_iterations")));
    }
};

}  // namespace

Json benchTouch(const TouchSize& size, const Say& say)
{
    const Touching touching(size, "[contact]\nfriction = 0.3\n"), free(size, "");
    Json result = {{"voxels", size.voxels},
                   {"threads", threadCount()},
                   {"nodes", touching.nodes},
                   {"steps", touching.steps},
                   {"couplings_a_step", touching.aStep("solve", "couplings")},
                   {"newton_iterations_a_step", touching.aStep("solve", "newton_iterations")},
                   {"linear_iterations_a_system", touching.iterationsASystem()},
                   {"linear_iterations_a_system_without", free.iterationsASystem()},
                   {"seconds_a_step", touching.seconds / touching.steps},
                   {"contact_seconds_a_step", touching.work.secondsOf("contact") / touching.steps},
                   {"seconds_a_step_without", free.seconds / free.steps}};
    say(fmt::format("touch {}: {} nodes, {:.0f} couplings, {:.3f} s a step, {:.0f} % of it contact", size.voxels,
                    touching.nodes, result["couplings_a_step"].get<double>(), result["seconds_a_step"].get<double>(),
                    100 * touching.work.secondsOf("contact") / touching.seconds));
    return result;
}

}  // namespace vdbfrac::lab::bench
