// Checks of the numbers that options take.
#pragma once

#include <CLI/CLI.hpp>

#include <cmath>
#include <limits>
#include <string>

namespace vdbfrac::cli {

/// A number above 0 that a double holds, up to `most`. CLI::PositiveNumber takes NaN, which compares with nothing, and
/// "1e999" arrives there as infinity or is called no number.
class PositiveFinite : public CLI::Validator {
public:
    explicit PositiveFinite(double most = std::numeric_limits<double>::max()) : CLI::Validator("POSITIVE")
    {
        func_ = [most](std::string& text) {
            double value = 0;
            const bool isNumber = CLI::detail::lexical_cast(text, value);
            if (isNumber && std::isfinite(value) && value > 0 && value <= most) return std::string();
            const std::string range =
                most < std::numeric_limits<double>::max() ? ", up to " + CLI::detail::to_string(most) : "";
            return "'" + text + "' is not a finite number above 0" + range;
        };
    }
};

/// A number of a size up to `most`: CLI's own check takes NaN.
class Bounded : public CLI::Validator {
public:
    explicit Bounded(double most) : CLI::Validator("")
    {
        func_ = [most](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::abs(value) <= most) return std::string();
            return "'" + text + "' is no number from -" + CLI::detail::to_string(most) + " to " +
                   CLI::detail::to_string(most);
        };
    }
};

/// Longest length [m] that an option takes. Grids hold floats, and areas of this size still fit into one.
inline constexpr double kLongestLength = 1e18;
/// Most GiB that an option takes: 2^63 bytes, so that it fits into 64 bits.
inline constexpr double kMaxGiB = 8589934592;

}  // namespace vdbfrac::cli
