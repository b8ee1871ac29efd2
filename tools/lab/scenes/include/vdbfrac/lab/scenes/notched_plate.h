// A plate with a notch, pulled until it tears.
#pragma once

#include <string>

namespace vdbfrac::lab {

/// A plate with a slit between two rows of nodes, its tip in the middle of an edge at any resolution.
std::string notchedPlate(int cells, const std::string& law);

/// Peak load [N]: pulls until the load has fallen clearly below it. 0: it did not tear.
double notchedPlatePeak(int cells, const std::string& law);

}  // namespace vdbfrac::lab
