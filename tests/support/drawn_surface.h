// Tests of the stages that move what is drawn.
#pragma once

#include <vdbfrac/core/stages.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::test {

constexpr double kDx = .05;  // m

/// A soft ball that falls. `others`: more tables; `more`: of [output].
inline std::string fallingBall(const std::string& others, const std::string& more = "")
{
    return "version = 1\nname = \"fall\"\ntime = { frames = [1, 8], fps = 24 }\ngrid = { voxel_size = 0.05 }\n"
           "[[body]]\nname = \"ball\"\nshape = { sphere = { radius = 0.3, center = [0, 0.32, 0] } }\n"
           "velocity = [0, -2, 0]\nmaterial = \"jelly\"\n"
           "[material.jelly]\nyoungs_modulus = 3e4\npoisson_ratio = 0.4\ndensity = 1000\n" +
           others + "[output]\nvdb = []\nmotion = true\n" + more;
}

/// The triangles of a mesh, of one fragment.
inline tetmesh::Surface surfaceOf(const tetmesh::RenderMesh& mesh, std::uint32_t fragment)
{
    const std::size_t faces = mesh.faces();
    return tetmesh::triangleSurface({mesh, std::vector(faces, fragment), std::vector<std::uint8_t>(faces, 0)},
                                    mesh.points);
}

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
