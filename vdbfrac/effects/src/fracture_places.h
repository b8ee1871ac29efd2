// Where a body is weaker or stronger than its material. Not installed.
//
//   f(X) = (1 + s n(X / L)) prod_i (1 + (f_i - 1) (1 - r_i^2)^2),   r_i = min(|X - C_i| / R_i, 1)
//   X    place at rest; kappa, and so the toughness, is f times that of the material there
//   s, L scatter and its size; n smooth noise in [-1, 1]
//   f_i, C_i, R_i  of each spot
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/values.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::effects {

/// Keys of [fracture] that say so.
std::span<const scene::Key> fracturePlaceKeys();

class FracturePlaces {
public:
    /// h: lattice spacing [m].
    FracturePlaces(const scene::Values& values, double h);
    double factor(const Vec3& X) const;  ///< f, at X [m]; above 0
    /// f is no less at any node of a body's material, or next to it. dx: voxel size [m].
    double leastOf(const tetmesh::BodyMesh& body, double dx) const;
    /// What the user should know of them, where voxels have this size [m], a sentence each.
    void note(std::span<const core::Body> bodies, double dx, std::vector<std::string>& notes) const;
    /// f at voxel nodes, which refers to this; none where it is 1 everywhere. dx: voxel size [m].
    std::function<double(Coord)> onVoxels(double dx) const;

private:
    struct Spot {
        Vec3 center;  // m
        double radius, factor;
    };
    bool isAlike() const { return scatter_ == 0 && spots_.empty(); }

    double scatter_;
    bool isSizeGiven_;
    double size_, cell_;  // m
    std::uint64_t seed_;
    std::vector<Spot> spots_;
};

}  // namespace vdbfrac::effects
