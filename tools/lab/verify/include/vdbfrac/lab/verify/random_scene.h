// Scenes by the dice, for what nobody thought of: hard, but such as a user could write.
#pragma once

#include <cstdint>
#include <string>

namespace vdbfrac::lab::verify {

/// The TOML text of a scene: one or two bodies that grips hold, pull, turn or push, or that fly; materials, time steps
/// and strengths over many decades. Speeds, loads and strengths go with the material: up to ten times the speed of
/// sound, resistances round what the scene could tear. The same text for the same seed; small enough for a second or
/// so.
std::string randomScene(std::uint64_t seed);

}  // namespace vdbfrac::lab::verify
