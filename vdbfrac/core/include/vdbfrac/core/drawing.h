// What frames draw of the bodies: their outer surfaces as the artist gave them, cut by the cracks.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/skin/skin.h>
#include <vdbfrac/tetmesh/cache_files.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// A body of one frame. Nothing in it changes any more.
struct DrawnBody {
    std::shared_ptr<const tetmesh::DrawnTopology> topology;
    std::vector<Vec3> points, normals;  ///< m
    std::vector<Vec3> velocity;         ///< m/s, of points
    double squeeze = 1;                 ///< volume over that at rest, where the material carries its points
    std::int64_t moved = 0;             ///< points that are not where the material carries them
};
using DrawnFrame = std::vector<DrawnBody>;

/// Surface of a collider where it is at t = 0: for pictures. Cylinders without end are long, halfspaces have none.
tetmesh::RenderMesh surfaceOf(const scene::Collider& collider, const scene::Grid& grid);

/// Points and normals put where the scene puts what a file holds.
void moveMesh(tetmesh::RenderMesh& mesh, const scene::FilePlace& place);

class DrawnMaterials;

class Drawing {
public:
    /// The simulation has made no step. Throws as reading the bodies' files does.
    Drawing(const scene::Scene& scene, const Simulation& simulation);
    /// Draws another mesh [m, at rest] for a body, with what is added to it and cut from it; before the first follow().
    /// `folder`: where its material libraries are. Throws InputError where that cannot be had of the mesh.
    void replace(const scene::Scene& scene, const Simulation& simulation, std::size_t body, tetmesh::RenderMesh mesh,
                 const std::filesystem::path& folder);

    /// Material libraries of the bodies' meshes, as one text; those that are not there are left out.
    const std::string& materials() const;
    /// Files of these.
    const std::vector<std::filesystem::path>& materialFiles() const;
    /// What the user should know of the surfaces, a sentence each.
    const std::vector<std::string>& notes() const { return notes_; }

    /// Cuts what has torn since the last call. Counts its work as "draw".
    void follow(const Simulation& simulation, Ledger& work);
    /// Cuts all, and draws what cracks have taken of the surfaces too: for a point cache. Counts its work as "draw".
    void followWhole(const Simulation& simulation, Ledger& work);
    /// The state of the simulation, on the bodies as they were at the last follow().
    DrawnFrame frame(const Simulation& simulation) const;
    /// The points of a body for positions [m] and velocities [m/s] of its nodes, where these carry them.
    DrawnBody body(std::size_t body, std::span<const Vec3> x, std::span<const Vec3> v) const;
    /// Puts such points of all bodies where they are seen at a time [s], and gives them their normals.
    void finish(const Stages& stages, double time, DrawnFrame& frame) const;
    /// As the last follow() left it.
    std::shared_ptr<const tetmesh::DrawnTopology> topology(std::size_t body) const
    {
        return surfaces_[body].skin.topology();
    }
    /// All points of a body's surface, as body() has them [m].
    std::vector<Vec3> carried(std::size_t body, std::span<const Vec3> x) const
    {
        return surfaces_[body].skin.carried(x);
    }
    /// Points of a body that ride some way outside of its material, as they did at the last follow().
    std::vector<skin::OutsidePoint> outside(std::size_t body) const { return surfaces_[body].skin.outside(); }

private:
    struct Surface {
        skin::Skin skin;
        std::int64_t revision = -1;  // of the body that the skin was cut for
    };
    static void cut(const Body& body, skin::Taken taken, Surface& surface, Ledger& work);
    void nameMaterials(const scene::Scene& scene, std::size_t body, tetmesh::RenderMesh& mesh) const;

    std::vector<Surface> surfaces_;
    // Names that frames have: for materials of the scene that have a colour, and for those of each body's mesh that
    // are another's in other bodies.
    std::map<std::string, std::string> colours_, tornColours_;
    std::vector<std::map<std::string, std::string>> renamed_;
    std::shared_ptr<DrawnMaterials> materials_;
    std::vector<std::string> notes_;
};

/// Box round all points that faces use [m]; of no size without any.
Bounds boundsOf(const DrawnFrame& frame);
/// The least volume of a body over that of the same material at rest; 1 where nothing is drawn.
double squeezeOf(const DrawnFrame& frame);

/// For a .ply of a frame, which has to live as long.
std::vector<tetmesh::PlyBody> plyBodies(const DrawnFrame& frame);

/// All bodies of a frame as triangles, and the velocity [m/s] of their points.
struct MovingSurface {
    tetmesh::Surface surface;
    std::vector<Vec3> velocity;
};
MovingSurface movingSurface(const DrawnFrame& frame);

}  // namespace vdbfrac::core
