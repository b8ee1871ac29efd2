// Where a body is weaker or stronger than its material. Not installed.
//
//   f(X) = (1 + s n(X / L)) prod_i (1 + (f_i - 1) (1 - r_i^2)^2),   r_i = min(|X - C_i| / R_i, 1)
//   X    place at rest; kappa, and so the toughness, is f times that of the material there
//   s, L scatter and its size; n smooth noise in [-1, 1]
//   f_i, C_i, R_i  of each spot
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/values.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::effects {

/// Keys of [fracture] that say so.
std::span<const scene::Key> fracturePlaceKeys();

class FracturePlaces {
public:
    /// h: lattice spacing [m].
    FracturePlaces(const scene::Values& values, double h);
    double factor(const Vec3& X) const;  ///< f, at X [m]
    double least() const;                ///< above 0; f is nowhere less
    /// f at voxel nodes, which refers to this; none where it is 1 everywhere. dx: voxel size [m].
    std::function<double(Coord)> onVoxels(double dx) const;

private:
    struct Spot {
        Vec3 center;  // m
        double radius, factor;
    };
    double scatter_, size_;  // m
    std::uint64_t seed_;
    std::vector<Spot> spots_;
};

}  // namespace vdbfrac::effects
