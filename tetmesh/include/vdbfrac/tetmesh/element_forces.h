// What the material of an element does to its corners, in space and in the rest configuration.
//
// Symbols: V volume of the material of a tet [m^3], W its energy density [J/m^3], F deformation gradient, P first
// Piola-Kirchhoff stress [Pa], N_a shape function of corner a.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cell.h>

#include <array>

namespace vdbfrac::tetmesh {

struct CornerForces {
    Vec3 elastic = Vec3::Zero();   ///< sum of V P grad N_a [N]: change of the energy as the corner moves in space
    Vec3 material = Vec3::Zero();  ///< sum of V (W I - F^T P) grad N_a [N]: as the material beside it moves at rest
    Mat3 F = Mat3::Zero();         ///< sum of V F / 4 [m^3]
    double volume = 0;             ///< sum of V / 4 [m^3]

    /// Adds a part of those of another.
    void add(double part, const CornerForces& other)
    {
        elastic += part * other.elastic, material += part * other.material;
        F += part * other.F, volume += part * other.volume;
    }
};

/// By corner; nothing where no tet with material is.
using ElementForces = std::array<CornerForces, kCorners>;

}  // namespace vdbfrac::tetmesh
