// The [solver] table of a scene in the solver's own terms. Not installed.
#pragma once

#include <vdbfrac/scene/scene.h>
#include <vdbfrac/solver/integrator.h>

namespace vdbfrac::core {

solver::NewtonSettings newtonSettingsOf(const scene::Solver& solver);
solver::Scheme schemeOf(const scene::Solver& solver);
solver::Elasticity elasticityOf(const scene::Solver& solver);

}  // namespace vdbfrac::core
