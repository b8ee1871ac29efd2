// "key.path=value" texts, written into a parsed document.
#pragma once

#include "complaints.h"
#include "document.h"

#include <string>
#include <vector>

namespace vdbfrac::scene {

/// Sets each value in turn, making tables that are missing. Paths that lead nowhere are complaints.
void applyOverrides(Node& root, const std::vector<std::string>& overrides, Complaints& complaints);

}  // namespace vdbfrac::scene
