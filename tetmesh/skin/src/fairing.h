// Torn faces and rims made fair: what is left of the voxels is taken off them. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/skin/skin_cut.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// For each point of a cut those next to it along torn faces, twice each unless at a rim.
Groups neighboursOf(const SkinCut& cut, std::uint32_t firstPoint);

/// Moves the points of a cut with these neighbours: in torn faces to even them, along rims on the smooth face, or the
/// sharp edge, of the outer surface that they are on. The outer surface may have any number of triangles to a voxel.
/// `share`: of each point, of its moves; on a rim it comes back to the surface in any case.
void fair(const SkinTopology& skin, const Groups& neighbours, double dx, std::span<const double> share,
          std::vector<SkinCut::Point>& points);

/// The point on the way from one to another that is no farther than this.
Vec3 within(double farthest, const Vec3& from, const Vec3& to);

/// Of each point of a cut: is it at the end of a crack, where the rim turns back? dx: voxel size [m].
std::vector<std::uint8_t> endsOfCracks(const SkinCut& cut, std::uint32_t firstPoint, double dx);

/// Moves points of torn faces that look against those round them to the middle of their neighbours, but not along rims.
/// Returns them, rising.
std::vector<std::uint32_t> unfold(const Groups& neighbours, std::uint32_t firstPoint, SkinCut& cut);

}  // namespace vdbfrac::skin
