// What each effect file offers to the list. Not installed.
#pragma once

#include <vdbfrac/effects/effects.h>

namespace vdbfrac::effects {

#define VDBFRAC_EFFECT(name) EffectInfo name();
#include <effect_names.h>
#undef VDBFRAC_EFFECT

}  // namespace vdbfrac::effects
