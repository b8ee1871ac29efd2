// A picture of a surface by OpenVDB's ray tracer. Needs no display.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::grid {

struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, rows from the top
};

struct View {
    Vec3 target = Vec3::Zero();              ///< what is looked at [m]
    Vec3 direction = Vec3(-0.5, -0.35, -1);  ///< of looking
    double extent = 1;                       ///< radius round the target that must be seen [m]
    int width = 640, height = 480;
    int samples = 4;  ///< rays a pixel
};

/// Renders a closed surface (current configuration): torn triangles red, the rest in a neutral colour, lit from the
/// upper left, soft background. `voxelSize` [m] is the resolution of the level set that is traced.
Image render(const tetmesh::Surface& surface, const View& view, double voxelSize);

}  // namespace vdbfrac::grid
