#pragma once

#include <string_view>

namespace vdbfrac::fuzz {

/// Loads a checkpoint of a small scene and goes on with a step. Throws as the libraries do.
void resumeFrom(std::string_view bytes);

}  // namespace vdbfrac::fuzz
