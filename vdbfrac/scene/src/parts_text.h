// The parts of a body or a grip as TOML text.
#pragma once

#include "toml_text.h"

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::scene {

PartTexts partTexts(const Body& body);
PartTexts partTexts(const Grip& grip);

}  // namespace vdbfrac::scene
