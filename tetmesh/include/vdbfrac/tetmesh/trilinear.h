// Values of nodes between them.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <cmath>

namespace vdbfrac::tetmesh {

/// The lowest corner of the cell that X lies in.
inline Coord floorOf(const Vec3& X) { return {int(std::floor(X.x())), int(std::floor(X.y())), int(std::floor(X.z()))}; }

/// Share of corner c of a unit cell in its point t.
inline double trilinearShare(int c, const Vec3& t)
{
    const Coord o = cornerOffset(c);
    return (o.x ? t.x() : 1 - t.x()) * (o.y ? t.y() : 1 - t.y()) * (o.z ? t.z() : 1 - t.z());
}

/// X in units of the field's coordinates.
inline double trilinear(const NodeField<float>& field, const Vec3& X)
{
    const Coord base = floorOf(X);
    const Vec3 t = X - base.toVec();
    double sum = 0;
    for (int c = 0; c < kCorners; ++c) sum += trilinearShare(c, t) * double(field(base + cornerOffset(c)));
    return sum;
}

}  // namespace vdbfrac::tetmesh
