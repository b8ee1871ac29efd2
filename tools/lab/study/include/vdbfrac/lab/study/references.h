// How far off: true values by extrapolation, observed orders, Pareto fronts, and how sure a median is.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::lab::study {

/// A value that was computed with a resolution h: a voxel or step size, or the inverse of a number of steps.
struct Level {
    double h = 0, value = 0;
};

struct Extrapolation {
    double value = 0;
    double order = 0;        ///< observed
    double uncertainty = 0;  ///< of the value
};

/// Limit for h -> 0 of values that behave as f + c h^p, from the finest three levels (Richardson extrapolation).
/// `levels`: the finest last, h falling. None where the last two differences are not of one sign and falling, or where
/// p is not in [0.3, 8]. The uncertainty is how far the limit moves when the finest level is left out, but at least a
/// twentieth of what it is away from the finest value; with three levels, or where there is no limit without the
/// finest, all of that; and no less than it is away from the limit at the order that is `expected`. Compare the grid
/// convergence index: P. J. Roache, Journal of Fluids Engineering 116 (1994).
std::optional<Extrapolation> richardson(std::span<const Level> levels, std::optional<double> expected = {});

/// Slope of log(error) over log(h) by least squares; none for fewer than two levels. Errors and h above 0.
std::optional<double> orderOf(std::span<const Level> errors);

/// Indices of those that no other one beats in both: no cost is lower without a larger error. By rising cost.
std::vector<std::size_t> paretoFront(std::span<const double> cost, std::span<const double> error);

struct Interval {
    double median = 0, low = 0, high = 0;
    double confidence = 0;  ///< that the true median lies in it
};

/// Median and the narrowest symmetric interval between order statistics that holds the true median with at least 90 %,
/// whatever the distribution; the widest where there are too few values for that (five give 94 %). `values` not empty.
Interval medianOf(std::vector<double> values);

/// Half the L1 distance of two lists of masses, each sorted from the largest and divided by its sum: the share of the
/// mass that is in fragments of other sizes, 0 to 1.
double massDistance(std::span<const double> a, std::span<const double> b);

}  // namespace vdbfrac::lab::study
