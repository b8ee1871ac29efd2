#pragma once

#include <string_view>

namespace vdbfrac::fuzz {

/// Loads a checkpoint of a small scene, and makes the surface of its frame. Throws as the libraries do.
void resumeFrom(std::string_view bytes);

}  // namespace vdbfrac::fuzz
