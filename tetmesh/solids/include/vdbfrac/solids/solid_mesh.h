// The surface of a body of analytic solids, with its edges, and of a mesh that solids were added to or cut from.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstddef>
#include <optional>
#include <span>

namespace vdbfrac::solids {

/// What a body is united with, and what it is without.
struct Carving {
    std::span<const Primitive> add, cut;
};

/// Closed surface of triangles with edges near `edge` [m], shorter where it is curved: the surface is off by a
/// twentieth of `edge` at most. Normals are those of smooth surfaces between edges. Solids without end are cut off
/// outside of the others. By CGAL's corefinement, with exact predicates. None where what is left is no 2-manifold, as
/// of solids that touch in an edge.
std::optional<tetmesh::RenderMesh> solidMesh(const Primitive& solid, const Carving& how, double edge);

/// A mesh [m] with all that it carries: faces that nothing is missing of as they are, parts of others with what their
/// face says there, then faces of the solids, with edges near `edge` [m] and normals if the mesh has any. None,
/// besides, where the mesh is not closed, not oriented outwards, or meets itself near a solid.
std::optional<tetmesh::RenderMesh> carvedMesh(const tetmesh::RenderMesh& mesh, const Carving& how, double edge);

/// The shells of a mesh [m] made one where they reach into each other; what lies inside of another is gone.
struct UnitedMesh {
    std::size_t shells = 0;                   ///< that do
    std::optional<tetmesh::RenderMesh> mesh;  ///< none where none do, or where they cannot be made one
};
/// Shells are triangles that hang together by points. Those that are closed and oriented outwards are looked at, and
/// have to meet none but others. What faces carry is kept, as carvedMesh() does.
UnitedMesh unitedMesh(const tetmesh::RenderMesh& mesh, double edge);

}  // namespace vdbfrac::solids
