// Made by docs/make_newtons.py from the output of `vdbfrac verify --newtons`.
#pragma once

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::cli {

/// Largest errors of bars this many lattice cells thick, of a lattice and nu [%].
struct BendingError {
    scene::LatticeKind lattice;
    double nu, cells, bending, torsion;
};
inline constexpr BendingError kBendingErrors[] = {{scene::LatticeKind::six, 0.3, 4, 1.85, 6.67}};

/// Largest errors of notched plates and beams this many lattice cells wide, on all lattices: of the peak load [%] and
/// of the slope of the crack [degrees].
struct TearingError {
    double cells, load, slope;
};
inline constexpr TearingError kTearingErrors[] = {{10, 6.47, 4.16}, {20, 3.67, 2.51}, {40, 0.675, 0.451}};

}  // namespace vdbfrac::cli
