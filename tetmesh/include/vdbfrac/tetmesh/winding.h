// Which way the corners of faces run.
#pragma once

#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace vdbfrac::tetmesh {

/// Turns the marked faces round, and their normals where these look more against the faces then than along them. Faces
/// that are not turned keep normals that they share with those.
void turnFaces(RenderMesh& mesh, std::span<const std::uint8_t> isTurned);

/// Turns faces round that run against their neighbours, and shells that are closed and inside out. A shell is what
/// hangs together by edges of two faces; points with equal coordinates count as one. In an open shell the faces that
/// are fewer are turned; one that has only one side stays as it is. Returns how many faces it has turned.
std::size_t windShells(RenderMesh& mesh);

}  // namespace vdbfrac::tetmesh
