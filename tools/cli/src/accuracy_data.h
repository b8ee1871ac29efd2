// Made by docs/make_accuracy.py of two studies.
#pragma once

namespace vdbfrac::cli {

/// Relative errors, of a beam in bending and of a block that tears; and the time of the block relative to "normal".
struct AccuracyData {
    double bending, peakLoad, work, time;
};
inline constexpr AccuracyData kDraft{0.024854, 0.37372, 0.701617, 0.0767026};
inline constexpr AccuracyData kNormal{0.00801866, 0.283957, 0.636783, 1};
inline constexpr AccuracyData kFine{0.00494912, 0.224348, 0.632436, 5.3604};

}  // namespace vdbfrac::cli
