// Broken surfaces -> the boundary of a solid, by CGAL (Polygon_mesh_processing; Alliez et al. 2022, Alpha wrapping).
#pragma once

#include <vdbfrac/tetmesh/surface_input.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace vdbfrac::repair {

/// How far a repair may go. Everything is cleaned; what follows is done where it is allowed and needed.
struct RepairOptions {
    bool fillHoles = true;       ///< close holes that have at most kLongestHole edges
    bool wrapWhenNeeded = true;  ///< wrap what is still open or intersects itself
    bool wrapAlways = false;
    double alpha = 0;   ///< of a wrap [m]: gaps and hollows narrower than twice this are closed; > 0
    double offset = 0;  ///< of a wrap [m]: how far outside the surface it lies; > 0
    std::uint64_t memoryLimit = ~std::uint64_t{0};  ///< bytes
    std::function<void(const std::string&)> say;    ///< told what is done next, where it can take seconds; may be empty
};

/// Longer holes are not filled: the time goes with the square of their edges.
inline constexpr std::size_t kLongestHole = 1000;

/// Faces with more corners are refused: the time goes with the square of their corners.
inline constexpr std::size_t kMaxCorners = 50000;

/// Corners looked at in search of intersections, before the search is given up: about six for each pair of triangles
/// whose boxes overlap. Meshes have 10 to 20 such pairs a triangle, but n triangles round one point have n^2 / 2.
inline constexpr std::uint64_t kMaxLookUps = 100'000'000, kMaxLookUpsPerFace = 300;

/// The repaired surface as triangles, and what was done.
struct Repaired {
    tetmesh::PolygonSoup soup;
    tetmesh::SurfaceReport before, after;
    std::size_t joinedPoints = 0;  ///< equal to another point, or used by no face
    std::size_t removedFaces = 0;  ///< without area, or there twice
    std::size_t turnedFaces = 0;   ///< whose winding did not agree with that of their neighbours
    std::size_t filledHoles = 0;
    double widestHole = 0;          ///< of those filled: longest extent [m]
    bool intersectsItself = false;  ///< before a wrap, holes filled. Not looked at under wrapAlways
    bool searchGivenUp = false;     ///< too many triangles are close to each other to find out whether it does
    std::uint64_t lookUps = 0;      ///< of corners, in that search
    bool wrapped = false;           ///< `soup` lies `offset` outside the surface
};

/// Joins equal points, drops faces without area and doubles, turns faces to agree with their neighbours, stitches
/// edges, fills holes, wraps: the gentlest of these that gives a closed surface which does not intersect itself, within
/// the options. Normals point outward where the result is closed. `before` is what tetmesh::examine says of the soup.
/// The same result for any number of threads. Throws InputError (for `file`: nothing left, a face of too many corners,
/// or a wrap that does not end), LimitError before a wrap too large is begun.
Repaired repairSurface(const tetmesh::PolygonSoup& soup, const tetmesh::SurfaceReport& before,
                       const RepairOptions& options, const std::string& file);

}  // namespace vdbfrac::repair
