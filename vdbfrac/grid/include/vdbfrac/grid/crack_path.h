// Where cracks have gone, between voxel nodes.
//
// A front takes whole nodes. If it only takes what opens most, a crack drifts along the rows of its lattice, as nothing
// in a plate that is pulled drives it back. So each node that a crack takes is given the point x of the crack's middle
// that is nearest to it, and nodes ahead are preferred by how near they are to the plane through the points round them:
//
//   x_p = p - d n,   d(p) = sum_q w (p - x_q).n / sum_q w,   w = (1 - r^2/(4/3 l)^2)^2
//   n   the way of the largest principal mean stress within l of p. Round a tip it turns by atan(4 K_II/K_I) / 2: for
//       little shear by 2 K_II/K_I, as a crack kinks by Erdogan & Sih 1963, and by no more than 45 degrees.
// Where no crack has been, nodes stand for x, with w R^8: a crack starts in the middle of what is driven most.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

#include <limits>
#include <optional>

namespace vdbfrac::grid {

class CrackPath {
public:
    /// No crack yet. Nodes that it may take lie in the box [lower, upper].
    CrackPath(Coord lower, Coord upper) : points_(lower, upper, nowhere(), nowhere()) {}

    /// A crack has taken `node`; `point` [voxels] is the place of its middle there.
    void add(Coord node, const Vec3& point) { points_.set(node, point); }

    /// What `add` was given; none where no crack has been.
    std::optional<Vec3> at(Coord node) const
    {
        const Vec3& point = points_(node);
        return point.x() < kNowhere ? std::optional(point) : std::nullopt;
    }

private:
    static constexpr double kNowhere = std::numeric_limits<double>::infinity();
    static Vec3 nowhere() { return Vec3::Constant(kNowhere); }

    tetmesh::NodeField<Vec3> points_;
};

}  // namespace vdbfrac::grid
