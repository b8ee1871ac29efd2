// What each effect file offers to the list. Not installed.
#pragma once

#include <vdbfrac/effects/effects.h>

namespace vdbfrac::effects {

EffectInfo gravity();
EffectInfo damping();
EffectInfo fracture();

}  // namespace vdbfrac::effects
