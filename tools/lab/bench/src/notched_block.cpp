#include "notched_block.h"

#include <bench_data.h>

#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/scene/reader.h>

#include <fmt/format.h>

namespace vdbfrac::lab::bench {

PreparedScene notchedBlock(int voxels, int lastFrame)
{
    return {scene::parseScene(
                kNotchedBlock, "notched_block.toml", effects::vocabulary(),
                {fmt::format("grid.voxel_size={}", 1. / voxels), fmt::format("time.frames=[1,{}]", lastFrame)}),
            defaultMemoryLimit()};
}

}  // namespace vdbfrac::lab::bench
