// What is drawn of a body: its outer surface, kept as it was given and torn cleanly, riding in the material.
#pragma once

#include <vdbfrac/skin/mean_motion.h>
#include <vdbfrac/skin/skin_cut.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Work of the last follow().
struct SkinWork {
    std::int64_t mixedVoxels = 0;  ///< that surfaces of cracks go through
    std::int64_t cutFaces = 0;     ///< parts of the outer surface that were made
    std::int64_t tornFaces = 0;
    std::int64_t specks = 0;   ///< closed pieces, tiny or without material, that were taken out
    std::int64_t defects = 0;  ///< places where rounding left a gap in the surface
    std::int64_t far = 0;      ///< points more than a cell away from the material that carries them
    std::int64_t bridges = 0;  ///< faces between fragments, which are drawn out as these part
};

class TouchingLips;
class TurnedNormals;

/// A point outside of the tet that carries it.
struct OutsidePoint {
    std::uint32_t point = 0;
    Vec3 X = Vec3::Zero();  ///< m, at rest
    double distance = 0;    ///< m, from the tet
};

/// Depends on the mesh and on the body as it is alone, so a run that is resumed draws the same.
class Skin {
public:
    /// `mesh` [m, at rest]: the outer surface of the body; `isInParts`: the body is several fragments at rest.
    Skin(tetmesh::RenderMesh mesh, const tetmesh::BodyMesh& body, const CrackStyle& style, bool isInParts = false);

    /// Cuts the surface by the cracks that the body has now, and takes points along with its nodes as they are numbered
    /// now. What cracks have taken of the surface is drawn with it where it is kept.
    void follow(const tetmesh::BodyMesh& body, std::span<const std::uint32_t> fragmentOfNode,
                Taken taken = Taken::dropped);

    /// Does not change once it is handed out.
    std::shared_ptr<const tetmesh::DrawnTopology> topology() const { return drawn_; }
    const SkinWork& work() const { return work_; }

    /// Positions [m] or velocities [m/s] of all points, from those of the body's nodes.
    std::vector<Vec3> carried(std::span<const Vec3> ofNodes) const;
    /// Draws closed lips on each other where they have passed each other: moves such points as carried() gave them [m],
    /// with their velocities [m/s].
    void partLips(std::span<Vec3> points, std::span<Vec3> velocity) const;
    /// Points that ride some way outside of the material, rising.
    std::vector<OutsidePoint> outside() const;
    /// Normals of topology().mesh with its points at `points` [m], as carried() gave them: those that were given turn
    /// with the faces round their points, those of torn faces are made of these.
    std::vector<Vec3> normals(std::span<const Vec3> points) const;

private:
    struct Embedding {
        const tetmesh::BodyMesh& body;
        const SkinCut& cut;
        const tetmesh::DrawnTopology& drawn;
        const FragmentAt& fragment;
        std::span<const std::uint32_t> fragmentOfNode;
    };
    void embed(const Embedding& what);
    std::vector<std::array<std::uint32_t, 2>> outsideEdges(const tetmesh::DrawnTopology& drawn) const;

    CrackStyle style_;
    tetmesh::RenderMesh mesh_;
    tetmesh::Fans fans_;
    SkinCutter cutter_;
    std::vector<std::uint8_t> isSeam_;  // at each place of the cutter's topology
    std::shared_ptr<const tetmesh::DrawnTopology> drawn_;
    std::vector<tetmesh::EmbeddedPoint> points_;
    MeanMotion outside_;
    struct Outside {
        std::uint32_t point, number;  // the latter in outside_.points()
    };
    std::vector<Outside> outsidePoint_;           // by rising point; several at one place
    std::size_t givenNormals_ = 0;                // the others are those of torn faces
    std::shared_ptr<const TurnedNormals> given_;  // those of the outer surface
    std::shared_ptr<const TouchingLips> lips_;    // null: they are drawn as simulated
    SkinWork work_;
};

}  // namespace vdbfrac::skin
