// What friction asks of a scene.
#pragma once

#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/scene.h>

#include <string>

namespace vdbfrac::scene {

/// Friction remembers where things stuck when a step ended; the midpoint rule only extrapolates to there. `place`: of
/// the table. Throws InputError.
inline void requireFrictionFits(const Scene& scene, const std::string& place, double friction)
{
    if (friction == 0 || scene.solver.integrator != Integrator::midpoint) return;
    throw InputError({place + ".friction", "friction does not go with integrator = \"midpoint\"", "0",
                      "take integrator = \"sdirk2\", or set friction = 0"});
}

}  // namespace vdbfrac::scene
