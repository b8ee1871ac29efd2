// Values of nodes between them. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/node_field.h>

namespace vdbfrac::skin {

/// X in voxels.
inline double trilinear(const tetmesh::NodeField<float>& field, const Vec3& X)
{
    const Vec3 low = X.array().floor();
    const Coord base{int(low.x()), int(low.y()), int(low.z())};
    const Vec3 f = X - low;
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
        const Coord d{k & 1, k >> 1 & 1, k >> 2};
        const double w = (d.x ? f.x() : 1 - f.x()) * (d.y ? f.y() : 1 - f.y()) * (d.z ? f.z() : 1 - f.z());
        if (w > 0) sum += w * field(base + d);
    }
    return sum;
}

}  // namespace vdbfrac::skin
