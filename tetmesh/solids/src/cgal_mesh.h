// Meshes as CGAL has them, for booleans. Not installed; a minute to compile.
#pragma once

#include "booleans.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include <cstdint>

namespace vdbfrac::solids {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Vertex = Mesh::Vertex_index;
using Face = Mesh::Face_index;
using Origins = Mesh::Property_map<Face, std::uint32_t>;

inline constexpr const char* kOrigin = "f:origin";

/// Of each face: the triangle that it is a part of.
inline Origins originsOf(Mesh& mesh) { return mesh.add_property_map<Face, std::uint32_t>(kOrigin, Parts::kNone).first; }

/// The same mesh with points and faces in the order of their rounded coordinates.
Mesh ordered(Mesh& mesh, double edge);

/// Corefinement leaves slivers along its lines, which fold over when their surface moves. Joins points that are close
/// to each other, then turns edges as Delaunay would have them; neither leaves faces, sharp edges or triangles that
/// were given. (CGAL's isotropic remeshing gives other triangles each time it runs.)
void tidy(Mesh& mesh, double edge);

}  // namespace vdbfrac::solids
