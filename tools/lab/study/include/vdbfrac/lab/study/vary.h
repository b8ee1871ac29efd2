// Values of keys as a command line has them: "grid.voxel_size=0.02,0.01".
#pragma once

#include <span>
#include <string>
#include <vector>

namespace vdbfrac::lab::study {

struct Varied {
    std::string key;
    std::vector<std::string> values;  ///< TOML texts
};

/// Splits at `separator`, but not inside of quotes and brackets.
std::vector<std::string> split(const std::string& text, char separator);

/// A word as people write it on a command line, in the quotes that TOML wants; all else as it is.
std::string quotedWord(const std::string& text);

/// "key=value,value,...". Throws InputError.
Varied parseVary(const std::string& text);

/// Every combination of a value of each key, as "key=value"; the last key changes first.
std::vector<std::vector<std::string>> combinations(std::span<const Varied> varied);

}  // namespace vdbfrac::lab::study
