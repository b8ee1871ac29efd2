#include "notched_block.h"

#include "../memory.h"

#include <bench_data.h>

#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/reader.h>

#include <fmt/format.h>

#include <utility>

namespace vdbfrac::tools::bench {

scene::Scene notchedBlock(int voxels, int lastFrame)
{
    return scene::parseScene(
        kNotchedBlock, "notched_block.toml", effects::vocabulary(),
        {fmt::format("grid.voxel_size={}", 1. / voxels), fmt::format("time.frames=[1,{}]", lastFrame)});
}

namespace {

std::vector<core::Effect*> pointers(const std::vector<std::unique_ptr<core::Effect>>& effects)
{
    std::vector<core::Effect*> p;
    for (const auto& e : effects) p.push_back(e.get());
    return p;
}

}  // namespace

Prepared::Prepared(scene::Scene what)
    : scene(std::move(what)),
      effects(effects::makeEffects(scene)),
      simulation(scene, pointers(effects), defaultMemoryLimit())
{
}

}  // namespace vdbfrac::tools::bench
