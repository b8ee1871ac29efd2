// A parsed document -> Scene.
#pragma once

#include "parts.h"

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::scene {

/// Reads every table. What is wrong goes to the complaints; the result counts only when there are none.
Scene readSections(const Node& root, const Vocabulary& vocabulary, Context& context);

}  // namespace vdbfrac::scene
