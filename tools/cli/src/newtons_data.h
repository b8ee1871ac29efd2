// Made by docs/make_newtons.py from the output of `vdbfrac verify --newtons`.
#pragma once
namespace vdbfrac::cli {
struct BendingError {
    double cells, bending, torsion;
};
inline constexpr BendingError kBendingErrors[] = {{4, 1.85, 6.67}};
struct TearingError {
    double cells, load, slope;
};
inline constexpr TearingError kTearingErrors[] = {{10, 5, 10}};
}
