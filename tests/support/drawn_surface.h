// A surface as a frame draws it, for the stages that move what is drawn.
#pragma once

#include <vdbfrac/core/stages.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::test {

/// A surface as a frame draws it.
struct Drawn {
    tetmesh::DrawnTopology topology;
    std::vector<std::uint32_t> used;
    std::vector<Vec3> points, velocity;
    std::vector<std::uint8_t> isMoved;

    explicit Drawn(std::vector<Vec3> at) : points(std::move(at))
    {
        for (std::uint32_t p = 0; p < points.size(); ++p) used.push_back(p);
        velocity.assign(points.size(), Vec3::Zero()), isMoved.assign(points.size(), 0);
    }
    explicit Drawn(const tetmesh::Surface& surface) : Drawn(surface.points)
    {
        topology = tetmesh::drawnTopology(surface);
    }
    void place(const lab::SceneRun& run, double time)
    {
        std::vector<core::DrawnSurface> all{{topology, used, points, velocity, isMoved}};
        run.simulation.stages().draw.at(0)->place(time, all);
    }
};

}  // namespace vdbfrac::test
