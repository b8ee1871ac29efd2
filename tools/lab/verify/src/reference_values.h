// Written by tests/python/references.py, which computes them by finite elements of its own. Do not edit: run it again.
#pragma once

namespace vdbfrac::lab::verify {

/// w / (E e^2) of a clamped strip, B / H = 0.2, nu = 0.0.
inline constexpr double kStrip20Nu00 = 0.5;
/// w / (E e^2) of a clamped strip, B / H = 0.2, nu = 0.3.
inline constexpr double kStrip20Nu30 = 0.55479;
/// w / (E e^2) of a clamped strip, B / H = 0.2, nu = 0.45.
inline constexpr double kStrip20Nu45 = 0.64769;
/// w / (E e^2) of a clamped strip, B / H = 0.1, nu = 0.3.
inline constexpr double kStrip10Nu30 = 0.55211;
/// w / (E e^2) of a clamped strip, B / H = 0.1, nu = 0.45.
inline constexpr double kStrip10Nu45 = 0.63716;
/// P / (E B d) of a plate 1 wide, 1.2 high between grips, with an edge crack of .4 in its middle, nu = 0.
inline constexpr double kPlateStiffness = 0.58026;
/// G W / (E d^2) of the same plate.
inline constexpr double kPlateRelease = 0.42083;
/// G / (E d^2) of a double cantilever with a groove, of a crack of 1 m (/m).
inline constexpr double kArms10Release = 0.028915;
/// G / (E d^2) of a double cantilever with a groove, of a crack of 1.4 m (/m).
inline constexpr double kArms14Release = 0.010466;

}  // namespace vdbfrac::lab::verify
