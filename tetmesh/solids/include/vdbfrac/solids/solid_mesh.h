// The surface of a body of analytic solids, with its edges.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <optional>
#include <span>

namespace vdbfrac::solids {

/// A solid, united with `add`, without `cut`.
struct SolidBody {
    const Primitive& shape;
    std::span<const Primitive> add, cut;
};

/// Closed surface of triangles with edges near `edge` [m], shorter where it is curved: the surface is off by a
/// twentieth of `edge` at most. Normals are those of smooth surfaces between edges. Solids without end are cut off
/// outside of the others. By CGAL's corefinement, with exact predicates. None where what is left is no 2-manifold, as
/// of solids that touch in an edge.
std::optional<tetmesh::RenderMesh> solidMesh(const SolidBody& body, double edge);

}  // namespace vdbfrac::solids
