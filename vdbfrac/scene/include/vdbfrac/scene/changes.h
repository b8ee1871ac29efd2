// In what two scenes differ.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::scene {

/// A key with another value, or a table that only one of two scenes has.
struct Change {
    std::string key;            ///< as in --set: "grip.0.move"; of a table its name: "contact"
    std::string before, after;  ///< as TOML; empty: there is none
};

/// Of two texts as writeScene() makes them: all keys written out, a line each. In the order of `after`, then what it
/// lacks.
std::vector<Change> changesBetween(std::string_view before, std::string_view after);

}  // namespace vdbfrac::scene
