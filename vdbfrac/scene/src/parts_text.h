// The parts of a body, a grip or a collider as TOML text.
#pragma once

#include "toml_text.h"

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::scene {

PartTexts partTexts(const Body& body);
PartTexts partTexts(const Grip& grip);
PartTexts partTexts(const Collider& collider);

}  // namespace vdbfrac::scene
