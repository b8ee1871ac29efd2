// Made by docs/make_newtons.py from the output of `vdbfrac verify --newtons`.
#pragma once

namespace vdbfrac::cli {

/// Largest errors of bars this many lattice cells thick [%].
struct BendingError {
    double cells, bending, torsion;
};
inline constexpr BendingError kBendingErrors[] = {{4, 1.85, 6.67}, {8, 0.532, 1.7}, {16, 0.142, 0.429}};

/// Largest errors of notched plates and beams this many lattice cells wide, on all lattices: of the peak load [%] and
/// of the slope of the crack [degrees].
struct TearingError {
    double cells, load, slope;
};
inline constexpr TearingError kTearingErrors[] = {{10, 6.47, 4.16}, {20, 3.67, 2.51}, {40, 0.675, 0.451}};

}  // namespace vdbfrac::cli
