// Made by docs/make_accuracy.py of two studies.
#pragma once

namespace vdbfrac::cli {

/// Relative errors, of a beam in bending and of a block that tears; and the time of the block relative to "normal".
struct AccuracyData {
    double bending, peakLoad, work, time;
};
inline constexpr AccuracyData kDraft{0.024854, 0.411612, 0.73682, 0.0625294};
inline constexpr AccuracyData kNormal{0.00801866, 0.27083, 0.628491, 1};
inline constexpr AccuracyData kFine{0.00494912, 0.202355, 0.586806, 6.14683};

}  // namespace vdbfrac::cli
