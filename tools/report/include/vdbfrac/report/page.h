// One HTML file on a run or a wedge, which needs nothing else.
#pragma once

#include <vdbfrac/report/record.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vdbfrac::report {

/// A page on a run. `sheet`: the bytes of a .png file, or none. `maxBytes`: of frames to play; 0 leaves the player out.
std::string runPage(const Record& record, const std::string& sheet, std::uint64_t maxBytes);

/// A run of a wedge, as its page shows it.
struct Compared {
    std::string name, status;
    std::vector<std::string> values;
    std::string picture;  ///< the bytes of a .png file, or none
    std::string report;   ///< link to its own page, or empty
    Json numbers;         ///< by name; see numbersOf
};

/// A page that compares runs; `records` of those that have begun, with their names.
std::string wedgePage(const std::string& name, const std::vector<std::string>& keys, const std::vector<Compared>& runs,
                      const Json& plots);

}  // namespace vdbfrac::report
