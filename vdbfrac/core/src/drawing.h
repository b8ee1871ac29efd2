// What frames draw of the bodies: their outer surfaces as the artist gave them, cut by the cracks. Not installed.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/skin/skin.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// A body of one frame. Nothing in it changes any more.
struct DrawnBody {
    std::shared_ptr<const tetmesh::DrawnTopology> topology;
    std::vector<Vec3> points, normals;  ///< m
    std::vector<Vec3> velocity;         ///< m/s, of points
};
using DrawnFrame = std::vector<DrawnBody>;

class Drawing {
public:
    /// The simulation has made no step.
    Drawing(const scene::Scene& scene, const Simulation& simulation);

    /// Cuts what has torn since the last frame. Counts its work, and takes its time, as "draw".
    DrawnFrame draw(const Simulation& simulation, Ledger& work);

private:
    struct Surface {
        skin::Skin skin;
        std::int64_t revision = -1;  // of the body that the skin was cut for
    };
    std::vector<Surface> surfaces_;
};

/// All bodies of a frame as triangles, and the velocity [m/s] of their points.
struct MovingSurface {
    tetmesh::Surface surface;
    std::vector<Vec3> velocity;
};
MovingSurface movingSurface(const DrawnFrame& frame);

}  // namespace vdbfrac::core
