// Which side of a surface is outside. Not installed.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/render_mesh.h>

namespace vdbfrac::skin {

/// Turns round the faces of those parts of a mesh [m, at rest] whose corners run the wrong way, and normals that then
/// look inside: material is where the level set of the body is below 0. Parts hang together by points; of one with
/// faces of both kinds most decide.
tetmesh::RenderMesh woundOutward(tetmesh::RenderMesh mesh, const tetmesh::BodyMesh& body);

}  // namespace vdbfrac::skin
