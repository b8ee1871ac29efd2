// phi between the voxels.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>

#include <functional>
#include <span>

namespace vdbfrac::grid {

/// phi [m] at X [m], trilinear between voxels. May be called from any number of threads while the level set does not
/// change; shares its grid, so it may outlive the owner.
std::function<double(const Vec3&)> phiSampler(const LevelSet& phi);

/// phi [m] at points X [m], by cubic interpolation: on a smooth surface exact to fourth order. As phiSampler() else.
std::function<void(std::span<const Vec3> X, std::span<double> phi)> cubicPhiSampler(const LevelSet& phi);

/// Box round all voxels inside the surface, two voxels wider [m]: phi > 0 on its faces. Empty (lower > upper) without
/// any.
Bounds materialBox(const LevelSet& phi);

}  // namespace vdbfrac::grid
