// Values at voxel nodes of a front, and the nodes round them. Not installed.
#pragma once

#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/tetmesh/body_mesh.h>

#include <algorithm>
#include <vector>

namespace vdbfrac::grid {

/// A voxel node seen from the middle of a ball.
struct Neighbour {
    Coord offset;
    Vec3 direction;
    double weight;  // (1 - r^2/radius^2)^2
};

/// All within `radius` [voxels] but the middle, which lies in no direction.
inline std::vector<Neighbour> neighboursWithin(double radius)
{
    const int reach = reachWithin(radius);
    std::vector<Neighbour> neighbours;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) {
                const Vec3 offset(x, y, z);
                const double inside = 1 - offset.squaredNorm() / (radius * radius);
                if (inside > 0 && inside < 1) neighbours.push_back({{x, y, z}, offset.normalized(), inside * inside});
            }
    return neighbours;
}

/// Values at some voxels.
class Sparse {
public:
    Sparse(const tetmesh::BodyMesh& mesh, const std::vector<Coord>& voxels, const std::vector<double>& values,
           double elsewhere = 0)
        : field_(mesh.phi().lower(), mesh.phi().upper(), elsewhere, elsewhere)
    {
        field_.cover(voxels);
        for (std::size_t i = 0; i < voxels.size(); ++i) field_.set(voxels[i], values[i]);
    }
    double operator()(Coord c) const { return field_(c); }
    double largestNear(Coord c, const std::vector<Neighbour>& near) const
    {
        double largest = field_(c);
        for (const Neighbour& n : near) largest = std::max(largest, field_(c + n.offset));
        return largest;
    }

private:
    tetmesh::NodeField<double> field_;
};

}  // namespace vdbfrac::grid
