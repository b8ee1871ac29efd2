#include <vdbfrac/lab/scenes/prepared_scene.h>

#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/effects/effects.h>

#include <utility>

namespace vdbfrac::lab {

namespace {

std::vector<core::Effect*> pointers(const std::vector<std::unique_ptr<core::Effect>>& effects, core::Effect* witness)
{
    std::vector<core::Effect*> p;
    for (const auto& e : effects) p.push_back(e.get());
    if (witness) p.push_back(witness);
    return p;
}

}  // namespace

PreparedScene::PreparedScene(scene::Scene what, std::uint64_t memoryLimit, core::Effect* witness)
    : scene(std::move(what)),
      effects(effects::makeEffects(scene)),
      simulation(scene, pointers(effects, witness), memoryLimit)
{
    core::requireSources(scene, simulation.stages());
}

void requireSound(const scene::Scene& scene)
{
    core::Stages stages;
    const auto effects = effects::makeEffects(scene);
    for (const auto& effect : effects) effect->join(stages);
    core::requireSources(scene, stages);
}

}  // namespace vdbfrac::lab
