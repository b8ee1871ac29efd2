// A level set from a function of the voxel, leaf by leaf. Not installed.
#pragma once

#include "body_sources.h"

#include <vdbfrac/base/primitive.h>

#include <functional>
#include <vector>

namespace vdbfrac::grid {

/// Box of leaf origins, half open, in voxels; multiples of 8.
struct LeafBox {
    openvdb::Coord lower, upper;
};
/// The leaves that touch a box [m].
LeafBox leafBox(const Bounds& bounds, double voxelSize);

/// Distance [m] to a surface at a point [m]; 1-Lipschitz.
using Distance = std::function<double(const Vec3&)>;

/// Origins of the leaves in a box that come within the band of the zero of a distance. Throws LimitError.
std::vector<openvdb::Coord> leavesNear(const Distance& distance, const LeafBox& box, const Build& build);

/// phi [m] at a voxel.
using Sampler = std::function<double(const openvdb::Coord&)>;

/// Fills the leaves at `origins` with phi(ijk), in parallel, and gives the rest its sign. `makeSampler` makes one
/// sampler for each chunk, since grid accessors must not be shared between threads.
openvdb::FloatGrid::Ptr sampleLeaves(const scene::Grid& grid, const std::vector<openvdb::Coord>& origins,
                                     const std::function<Sampler()>& makeSampler);

}  // namespace vdbfrac::grid
