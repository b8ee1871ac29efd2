#include "obstacles.h"

#include <vdbfrac/base/number_text.h>

#include <algorithm>

namespace vdbfrac::effects {

/// What begins in a collider stays as deep: most often that is a mistake.
void noteDepths(const contact::TouchingSurface& surface, std::span<const core::Body> bodies, const Obstacles& obstacles,
                std::vector<std::string>& notes)
{
    constexpr double kTold = .5;  // voxels
    const Places places = obstacles.placesAt(0);
    std::vector<double> most(bodies.size() * obstacles.size(), 0);
    for (std::size_t i = 0; i < surface.size(); ++i)
        for (std::size_t c = 0; c < obstacles.size(); ++c) {
            double& depth = most[surface.body(i) * obstacles.size() + c];
            depth = std::max(depth, -obstacles.distance(surface.restPosition(i), c, places));
        }
    for (std::size_t k = 0; k < most.size(); ++k)
        if (most[k] > kTold * bodies[k / obstacles.size()].mesh->voxelSize())
            notes.push_back("body '" + bodies[k / obstacles.size()].name + "' begins up to " + shortNumber(most[k], 3) +
                            " m deep in collider '" + obstacles[k % obstacles.size()].collider().name +
                            "': it is not pushed out");
}

}  // namespace vdbfrac::effects
