// Numbers as people write them, whatever the locale of the program.
#pragma once

#include <string>

namespace vdbfrac {

/// With so many digits that count: "0.05", "1.2e-07".
std::string shortNumber(double value, int digits = 6);

}  // namespace vdbfrac
