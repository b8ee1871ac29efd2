// A of docs/physics.md, kappa = A Gc / l: measured on cracks that run through clamped strips.
#pragma once

#include <string>

namespace vdbfrac::lab::verify {

/// What a crack runs through.
struct CalibrationStrip {
    std::string lattice = "six";  ///< as in a scene
    std::string driver = "tension";
    double poissonRatio = 0;  ///< 0, .3 or .45
    int cells = 20;           ///< lattice cells, of the height of 1 m
};

/// A = kappa l over the energy that the crack takes per area; NaN where it did not get through.
struct Calibration {
    double byRelease = 0;     ///< G of the strip
    double byDissipated = 0;  ///< work put in less energy stored, over the way

    double mean() const { return 2 / (1 / byRelease + 1 / byDissipated); }
};

/// Throws InputError for lattices, drivers and ratios that there are not.
Calibration calibrate(const CalibrationStrip& strip);

}  // namespace vdbfrac::lab::verify
