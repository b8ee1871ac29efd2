// A parsed document -> Scene.
#pragma once

#include "parts.h"

#include <vdbfrac/scene/scene.h>

#include <span>

namespace vdbfrac::scene {

/// Reads every table. What is wrong goes to the complaints; the result counts only when there are none.
Scene readSections(const Node& root, std::span<const TableSpec> effects, Context& context);

}  // namespace vdbfrac::scene
