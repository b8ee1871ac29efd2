// Period and damping of something that swings, from samples over time.
#pragma once

#include <optional>
#include <span>

namespace vdbfrac::lab::study {

/// Samples u at times t [s], as many of each; t rises.
struct Samples {
    std::span<const double> t, u;
};

/// Mean distance [s] of crossings of `rest` in the same direction, interpolated between samples. Without `rest`, of the
/// mean over whole swings. None when there are fewer than two crossings in one of both directions.
std::optional<double> periodOf(const Samples& samples, std::optional<double> rest);

/// Rate [1/s] at which the peaks on both sides of `rest` decay: the slope of the logarithm of their heights over time,
/// by least squares. Heights and times are those of parabolas through three samples. None when there are fewer than two
/// peaks.
std::optional<double> dampingOf(const Samples& samples, std::optional<double> rest);

}  // namespace vdbfrac::lab::study
