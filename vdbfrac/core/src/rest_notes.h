// What a user should know of the bodies before anything moves. Not installed.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// Adds a sentence for each body that is thin or in several parts, each two that overlap, each grip faster than sound.
/// `h` [m]: lattice spacing. Body b is made of scene.bodies[b].
void noteRestState(const scene::Scene& scene, std::span<const Body> bodies, double h, std::vector<std::string>& notes);

/// Nodes of the system that a grip holds, rising.
using GripNodes = std::function<std::span<const std::uint32_t>(std::size_t grip)>;
/// Grips that leave nothing free, hold what others hold, or set off far from rest are usually mistakes.
void noteGrips(const scene::Scene& scene, std::span<const Body> bodies, const GripNodes& nodesOf,
               std::vector<std::string>& notes);

}  // namespace vdbfrac::core
