// One HTML file on a run or a wedge, which needs nothing else.
#pragma once

#include <vdbfrac/report/record.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::report {

/// A page on a run. `sheet`: a .png file, or empty. `maxBytes`: of frames to play; 0 leaves the player out.
std::string runPage(const Record& record, const std::filesystem::path& sheet, std::uint64_t maxBytes);

/// A run of a wedge, as its page shows it.
struct Compared {
    std::string name, status;
    std::vector<std::string> values;
    std::filesystem::path picture;  ///< a .png file, or empty
    std::string report;             ///< link to its own page, or empty
    Json numbers;                   ///< by name; see numbersOf
};

/// A page that compares runs; `records` of those that have begun, with their names.
std::string wedgePage(const std::string& name, const std::vector<std::string>& keys, const std::vector<Compared>& runs,
                      const Json& plots);

}  // namespace vdbfrac::report
