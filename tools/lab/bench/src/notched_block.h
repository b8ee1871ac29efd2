// The scene that ships, at any resolution.
#pragma once

#include <vdbfrac/lab/scenes/prepared_scene.h>

namespace vdbfrac::lab::bench {

/// data/scenes/notched_block.toml with so many voxels along an edge, from frame 1 to `lastFrame`.
PreparedScene notchedBlock(int voxels, int lastFrame);

}  // namespace vdbfrac::lab::bench
