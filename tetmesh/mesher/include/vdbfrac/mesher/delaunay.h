// Delaunay tets of a solid that is given by phi, by CGAL's Mesh_3 (Boissonnat & Oudot 2005; Jamin et al. 2015).
//
// The surface is refined until its triangles are small, well shaped and near to phi = 0, the inside until its tets are.
// Then slivers, the flat tets that Delaunay refinement leaves, are moved or weighted away (Tournois et al. 2009; Cheng
// et al. 2000). CGAL stays behind this header.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/tet_mesh.h>

#include <cstddef>
#include <functional>
#include <vector>

namespace vdbfrac::mesher {

using Polyline = std::vector<Vec3>;  ///< two points or more [m]; closed when the last equals the first

struct ImplicitSolid {
    /// Negative inside, roughly a distance near 0 [m]; safe to call from any thread.
    std::function<double(const Vec3&)> phi;
    Bounds box;                        ///< holds the solid with some room: phi > 0 on its faces
    std::vector<Polyline> sharpEdges;  ///< on the surface, kept as edges of the mesh; meet at their ends only
};

/// Bound on circumradii over the edges that it leads to. A regular tet has .61; refinement stops below its bound, on
/// average at two thirds of it.
inline constexpr double kRadiusOfEdge = 0.9;

/// Lengths in m. A regular tet with edges a has a circumradius of .61 a, its faces of .58 a.
struct DelaunayCriteria {
    double facetSize = 0;      ///< largest circumradius of a triangle of the surface; > 0
    double facetAngle = 25;    ///< smallest angle of one [degrees]; the refinement is sure to end up to 30
    double facetDistance = 0;  ///< from the middle of one to phi = 0; 0: a tenth of facetSize
    double cellSize = 0;       ///< largest circumradius of a tet; 0: facetSize
    /// Largest circumradius over shortest edge of a tet. Refinement is proven to end above 2; but with 2, slivers below
    /// 10 degrees are left now and then at rounded sharp edges, with 1.6 none were seen.
    double radiusEdge = 1.6;
    double edgeSize = 0;  ///< of the pieces of sharp edges; 0: facetSize
    /// Where it is smaller than the sizes above it takes their place [m]; may be empty.
    std::function<double(const Vec3&)> sizing;
    bool perturb = true;        ///< move points until no dihedral angle is below sliverAngle
    bool exude = true;          ///< then weight points to the same end
    double sliverAngle = 12;    ///< [degrees]
    std::size_t maxPoints = 0;  ///< of the mesh while it is refined; 0: no limit
};

/// Meshes every component of the solid that is wider than half a facetSize, and every cavity. One thread; the same bits
/// on every call. Points come in the order of a Hilbert curve, tets by their lowest point. The boundary is a closed
/// 2-manifold. Throws InputError (criteria out of range, phi not finite, no material, material at the faces of the
/// box), LimitError (maxPoints).
tetmesh::TetMesh delaunayMesh(const ImplicitSolid& solid, const DelaunayCriteria& criteria);

}  // namespace vdbfrac::mesher
