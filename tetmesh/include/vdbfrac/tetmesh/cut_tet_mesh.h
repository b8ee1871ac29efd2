// A mesh of tets that encloses the material, cut by phi, with nodes duplicated where material is apart.
//
// phi lives on voxels and is taken, trilinear, at the points of the mesh; within a tet it is linear, so the material of
// a tet is one convex piece. Each point has a copy for each part of its star that hangs together: two tets with a face
// in common share the copies of its points where material is on the face. phi only grows, so copies only split: a new
// one lies in exactly one old one. The same rule as on a lattice (cut_mesh.h), after Teran et al. 2005 / Sifakis et al.
// 2007.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/tet_mesh.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

class NodalWeights;

class CutTetMesh final : public BodyMesh {
public:
    /// `spacing`: the edge that tets mostly have [m]; `phi` [m] on voxels, its box holds every voxel of material and
    /// two layers more. Tets and points are sorted into blocks of 8 spacings. Throws InputError when phi < 0 at a
    /// boundary point: the mesh has to enclose the material. `shape`: what phi is of; volumes are true then.
    CutTetMesh(const TetMesh& mesh, double spacing, double voxelSize, NodeField<float> phi,
               const RestShape& shape = {});
    CutTetMesh(CutTetMesh&&) noexcept;
    ~CutTetMesh() override;

    CutUpdate update(std::span<const VoxelPhi> newPhi) override;
    const NodeField<float>& phi() const override { return phi_; }
    const NodeField<float>& restPhi() const override { return rest_; }
    const std::vector<CellElement>& elements() const override { return elements_; }
    std::span<const TetGradients> gradients() const override { return gradients_; }
    std::size_t nodeCount() const override { return pointOfNode_.size(); }
    Vec3 restPosition(std::size_t node) const override { return points_[pointOfNode_[node]]; }
    double spacing() const override { return h_; }
    double voxelSize() const override { return dx_; }
    using BodyMesh::volume;
    double volume() const override { return volume_; }
    EmbeddedSurface surface() const override;
    PhiTets phiTets(double depth) const override;
    std::vector<Coord> voxelsAbove(std::span<const double> density, double threshold) const override;
    void addTetsRound(Coord voxel, std::vector<TetShare>& tets) const override;

    std::size_t pointCount() const { return points_.size(); }
    std::size_t tetCount() const { return tets_.size(); }
    /// Number of the first copy of each point, and the end.
    const std::vector<std::uint32_t>& firstNode() const { return firstNode_; }

protected:
    std::vector<std::uint32_t> elementsRound(const Vec3& X) const override;

private:
    /// Rest shape of a tet.
    struct Shape {
        TetGradients gradient;  ///< times h
        double volume = 0;      ///< over h^3
    };

    void sortIntoBlocks(const TetMesh& mesh);
    void findStars();
    void measureShapes();
    double phiAt(const Vec3& X) const;
    std::vector<std::uint32_t> takePhi(std::span<const VoxelPhi> newPhi, CutUpdate& update);
    void cut(std::span<const std::uint32_t> tets);
    std::vector<std::uint32_t> allTets() const;
    void correct(const RestShape& shape);
    void attach();
    void detach(std::uint32_t point, std::vector<std::uint32_t>& tets);
    void classify(std::uint32_t point);
    void numberNodes();
    void makeElements();
    PreviousElements replaceElements(std::span<const std::uint32_t> cutTets);
    const NodalWeights& weights() const;
    std::vector<std::uint32_t> previousNodes(const std::vector<std::uint8_t>& oldLabel,
                                             const std::vector<std::uint32_t>& oldFirst) const;

    double h_ = 1, dx_ = 1;
    NodeField<float> phi_, rest_;
    std::vector<Vec3> points_;
    std::vector<std::array<std::uint32_t, 4>> tets_;
    std::vector<std::uint32_t> patchOfTet_;
    std::vector<Shape> shape_;                        // of each tet
    std::vector<std::uint32_t> starStart_, star_;     // tets round each point, by rising tet
    std::vector<std::array<std::uint32_t, 4>> slot_;  // of each tet: where it is in the stars of its points
    std::vector<std::pair<Coord, std::uint32_t>> pointsOfVoxelCell_;  // sorted
    struct Weights;
    std::unique_ptr<Weights> weights_;  // made when they are first asked for

    std::vector<double> seen_;               // phi at each point, snapped to 0 within kSnap dx
    std::vector<std::uint8_t> wasMaterial_;  // was phi < 0 there at first?
    std::vector<TetCut> cut_;                // of each tet
    // Of each tet at rest: its true volume over that of the linear cut; of one without a point inside, over that of the
    // tet. Empty without a shape.
    std::vector<double> correction_;
    // Of each tet that holds material without a point inside: its faces with material, bit a opposite to point a. It
    // hangs on the inside points of the tets beside it, and goes with the first that fails. Empty without a shape.
    std::vector<std::uint8_t> attached_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> anchors_;  // such points, with their tets; sorted
    std::vector<std::uint8_t> label_;   // of each slot: the copy of the point that the tet has; kNone without material
    std::vector<std::uint8_t> copies_;  // of each point
    std::vector<std::uint32_t> firstNode_;  // of each point, and the end
    std::vector<std::uint32_t> pointOfNode_;
    std::vector<CellElement> elements_;
    std::vector<TetGradients> gradients_;     // of each element
    std::vector<std::int32_t> elementOfTet_;  // -1 without material
    std::vector<std::uint32_t> tetOfElement_;
    double volume_ = 0;  // m^3
};

}  // namespace vdbfrac::tetmesh
