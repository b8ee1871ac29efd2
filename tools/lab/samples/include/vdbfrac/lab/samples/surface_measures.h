// Surfaces of cut meshes in numbers.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstddef>

namespace vdbfrac::lab {

/// Edges of a surface at which it is not a closed, oriented 2-manifold.
struct BadEdges {
    std::size_t open = 0;     ///< whose faces do not match
    std::size_t crowded = 0;  ///< with more than two faces
};

/// A good edge has exactly one triangle in each direction.
BadEdges badEdges(const tetmesh::EmbeddedSurface& surface);

/// Volume within the surface at rest [m^3], by the divergence theorem.
double enclosedVolume(const tetmesh::BodyMesh& mesh);

}  // namespace vdbfrac::lab
