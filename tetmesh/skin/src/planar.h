// A polygon in a plane, divided into triangles along lines in it. Not installed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::skin {

/// The outline goes round points in order, counter-clockwise; lines part the polygon into regions, and a region and the
/// one beyond a line have opposite labels.
struct PlanarPolygon {
    std::vector<std::array<double, 2>> points;
    std::vector<std::uint32_t> outline;               ///< points in order
    std::vector<std::uint8_t> label;                  ///< beside the outline from each of its points to the next
    std::vector<std::array<std::uint32_t, 2>> lines;  ///< pairs of points
};

struct PlanarTriangles {
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise
    std::vector<std::uint8_t> label;                      ///< of each
    bool isSound = true;  ///< else lines cross or points coincide, and a part may be missing
};

/// By a constrained Delaunay triangulation.
PlanarTriangles triangulate(const PlanarPolygon& polygon);

}  // namespace vdbfrac::skin
