#include <vdbfrac/scene/reader.h>

namespace vdbfrac::scene {

std::string exampleText()
{
    return R"(# A soft block with a round notch in one side, pulled upwards by its top while its bottom is held.
version = 1
name = "notched_block"

[time]
frames = [1, 96]          # frame 1 is the rest state, t = 0
fps = 24

[grid]
voxel_size = 0.05         # m

[[body]]
name = "block"
shape = { box = { size = [1, 1, 1] } }
cut = [{ cylinder = { axis = "z", radius = 0.35, center = [0.5, 0, 0] } }]
material = "gel"

[material.gel]
youngs_modulus = 1e5      # Pa
poisson_ratio = 0.3
density = 1000            # kg/m^3

[[grip]]
name = "top"
body = "block"
region = { halfspace = { normal = [0, 1, 0], offset = 0.45 } }
move = { velocity = [0, 0.1, 0] }   # m/s

[[grip]]
name = "bottom"
body = "block"
region = { halfspace = { normal = [0, -1, 0], offset = 0.45 } }
move = { velocity = [0, 0, 0] }

# Effects are simulated where a scene names them. With this one the block tears:
# [fracture]
# toughness = 200         # J/m^2

[output]
vdb = ["phi", "energy"]
obj = true
)";
}

}  // namespace vdbfrac::scene
