// Made by docs/make_newtons.py from the output of `vdbfrac verify --newtons`.
#pragma once

#include <vdbfrac/scene/scene.h>

namespace vdbfrac::cli {

// clang-format off
/// Largest errors of bars this many lattice cells thick, of a lattice and nu [%].
struct BendingError {
    scene::LatticeKind lattice;
    double nu, cells, bending, torsion;
};
inline constexpr BendingError kBendingErrors[] = {
    {scene::LatticeKind::delaunay, 0.3, 4, 16.9, 35.6},
    {scene::LatticeKind::delaunay, 0.3, 8, 4.25, 10.4},
    {scene::LatticeKind::delaunay, 0.49, 4, 72.3, 104},
    {scene::LatticeKind::delaunay, 0.49, 8, 18.9, 36.6},
    {scene::LatticeKind::five, 0.3, 4, 2.35, 8.92},
    {scene::LatticeKind::five, 0.3, 8, 0.671, 2.34},
    {scene::LatticeKind::five, 0.49, 4, 2.49, 11.4},
    {scene::LatticeKind::five, 0.49, 8, 0.705, 4.46},
    {scene::LatticeKind::six, 0.3, 4, 1.85, 6.67},
    {scene::LatticeKind::six, 0.3, 8, 0.532, 1.7},
    {scene::LatticeKind::six, 0.3, 16, 0.142, 0.429},
    {scene::LatticeKind::six, 0.49, 4, 1.84, 6.68},
    {scene::LatticeKind::six, 0.49, 8, 0.523, 1.7},
};

/// Largest errors of notched plates and beams this many cells of a lattice wide: of the peak load [%] and of the slope
/// of the crack [degrees].
struct TearingError {
    scene::LatticeKind lattice;
    double cells, load, slope;
};
inline constexpr TearingError kTearingErrors[] = {
    {scene::LatticeKind::delaunay, 20, 6.61, 1.71},
    {scene::LatticeKind::five, 20, 2.91, 2.34},
    {scene::LatticeKind::six, 10, 6.47, 4.16},
    {scene::LatticeKind::six, 20, 3.67, 2.51},
    {scene::LatticeKind::six, 40, 0.675, 0.451},
};

// clang-format on

}  // namespace vdbfrac::cli
