// A block with a narrow slit, as a solid and as a mesh.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <string>

namespace vdbfrac::lab {

/// A block with a slit across the middle of its top, through its whole width, turned and moved. Lengths in m.
struct SlitBlock {
    double width = 0, depth = 0.6;
    Mat3 turn = Mat3::Identity();
    Vec3 at = Vec3(0.013, -0.021, 0.034);
    Vec3 size = Vec3(1, 1, 0.7);

    /// Positive outside. Its zero and sign are exact; it is the distance but at edges.
    double phi(const Vec3& X) const;
    tetmesh::PolygonSoup mesh() const;
};

/// A mesh as the text of an .obj file, with 17 digits.
std::string objText(const tetmesh::PolygonSoup& soup);

}  // namespace vdbfrac::lab
