// vdbfrac check, vdbfrac scene.
#include "options.h"
#include "sim_plan.h"

#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/estimate.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/scene/reader.h>

#include <cstdio>

namespace vdbfrac::cli {

namespace {

/// What there is to say of bodies, grips and effects as a run begins. Throws as the run would.
std::vector<std::string> notesOfStart(const scene::Scene& scene, std::uint64_t memoryLimit)
{
    const core::SceneEstimate estimate = core::estimateScene(scene, memoryLimit, effects::bytesPerTet(scene));
    core::requireMemory(estimate, memoryLimit);
    if (isQuicklyMade(scene, estimate)) return lab::PreparedScene(scene, memoryLimit).simulation.stages().notes;
    lab::requireSound(scene);
    return {
        "bodies of more than a million tets, or on a Delaunay lattice, are not made here: what grips hold, and what "
        "thin parts and overlaps have to say, is told when the run begins"};
}

}  // namespace

Action addCheck(CLI::App& app)
{
    struct Options {
        std::string scene;
        std::vector<std::string> set;
        bool quick = false;
        double maxMemory = 0;  // GiB
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("check",
                                           "Check a scene and the files it names: report all errors of the text with "
                                           "line and column, then make the bodies as a run would");
    command->add_option("SCENE", options->scene, "Scene file (TOML)")->required();
    addSet(*command, options->set, "Change a key first: key=value, as in grid.voxel_size=0.02");
    command->add_flag("--quick", options->quick, "The text alone: read no meshes and no .vdb files");
    addMaxMemory(*command, options->maxMemory, "a run");
    return [options] {
        scene::Scene s = scene::readScene(options->scene, lab::study::vocabulary(), options->set);
        const std::size_t effects = s.tables.size();
        std::vector<std::string> notes = effects::notesOf(s);
        if (options->quick) {
            std::erase_if(s.colliders, [](scene::Collider& c) { return scene::fileOf(c.shape) != nullptr; });
            lab::requireSound(s);
        } else {
            const std::vector<std::string> more = notesOfStart(s, memoryLimitOf(options->maxMemory));
            notes.insert(notes.end(), more.begin(), more.end());
        }
        for (const std::string& note : notes) std::printf("note: %s\n", note.c_str());
        std::printf("%s: ok (%zu %s, frames %d-%d, %zu %s)\n", options->scene.c_str(), s.bodies.size(),
                    s.bodies.size() == 1 ? "body" : "bodies", s.time.firstFrame, s.time.lastFrame, effects,
                    effects == 1 ? "effect" : "effects");
        return int(kDone);
    };
}

Action addScene(CLI::App& app)
{
    struct Options {
        bool defaults = false, example = false, schema = false;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("scene", "Print what a scene can say: every key, an example, a JSON schema");
    auto* group = command->add_option_group("what", "one of");
    group->add_flag("--defaults", options->defaults, "Every key with its default, unit, range and meaning");
    group->add_flag("--example", options->example, "A small complete scene to start from");
    group->add_flag("--schema", options->schema, "JSON schema, for editors");
    group->require_option(1);
    return [options] {
        const auto vocabulary = lab::study::vocabulary();
        const std::string text = options->defaults  ? scene::defaultsText(vocabulary)
                                 : options->example ? scene::exampleText()
                                                    : scene::schemaText(vocabulary);
        std::fputs(text.c_str(), stdout);
        return int(kDone);
    };
}

}  // namespace vdbfrac::cli
