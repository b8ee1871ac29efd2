// Sharp edges of a surface, as lines that a mesh can keep.
#pragma once

#include <vdbfrac/mesher/delaunay.h>
#include <vdbfrac/tetmesh/surface.h>

#include <vector>

namespace vdbfrac::mesher {

/// Lines along the edges where two faces meet at an angle above `degrees` between their normals, or more than two faces
/// do. They end where three or more such edges meet, and where a line turns by more than `degrees`. Points with equal
/// coordinates count as one. `degrees` in (0, 180).
std::vector<Polyline> sharpEdges(const tetmesh::PolygonSoup& soup, double degrees);

}  // namespace vdbfrac::mesher
