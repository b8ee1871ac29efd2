// The material as simulation elements: lattice cells cut by phi, with nodes duplicated where material is apart.
//
// phi lives on voxel nodes, h = m dx apart from the lattice. Every sub-tet with material has its own copies of its
// parent tet's nodes; sub-tets that share a face with material on it share the copies of the lattice nodes they have
// in common (union-find in the star of each lattice node). The classes are the nodes of the simulation.
// phi only grows, so classes only split: a new class lies in exactly one old class.
// Source: Hegemann et al. 2013, section 4; node duplication after Teran et al. 2005 / Sifakis et al. 2007.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

// With the true shape of the body at rest the cut is corrected. Sub-tets hold more or less than a linear phi says:
// their volumes are scaled so that they are true at rest, and stay scaled. Those at edges and corners may hold material
// without a vertex inside. They are attached to the inside corners of their voxel, and go with the first that fails.
// Where the surface is drawn does not change.

/// The material part of one sub-tet of a cut cell.
struct Piece {
    std::uint16_t subTet = 0;   ///< index into the cell stencil
    std::uint16_t element = 0;  ///< of the cell's elements
    TetCut cut;
};

/// A lattice cell that holds material.
struct Cell {
    Coord coord;  ///< lattice coordinates of corner 0
    std::uint32_t patch = 0;
    bool whole = true;  ///< all its voxel nodes are material: one element, no pieces kept
    std::uint32_t firstElement = 0, elements = 1;
    std::uint32_t corrections = 0;  ///< which; 0: none
    std::vector<Piece> pieces;      ///< of a cell that is not whole, by sub-tet
};

/// A sub-tet of a star that has material and no vertex inside.
struct AttachedTet {
    std::int32_t anchor = -1;  ///< vertex of the star that it hangs on; -1: it is none
    std::uint8_t faces = 0;    ///< with material at rest: bit a is that opposite to vertex a
};

class TrueShare;

class CutMesh final : public BodyMesh {
public:
    CutMesh() = default;
    /// Cuts everything. phi [m] on voxel coordinates; its box must hold every material voxel and two layers more.
    /// `shape`: what phi is of; volumes are true then, but not of whole tets. Throws Error for a coarsening that is not
    /// possible.
    CutMesh(Lattice lattice, NodeField<float> phi, const RestShape& shape = {});

    CutUpdate update(std::span<const VoxelPhi> newPhi) override;

    const Lattice& lattice() const { return lattice_; }
    const NodeField<float>& phi() const override { return phi_; }
    const NodeField<float>& restPhi() const override { return rest_; }
    /// phi as the cut sees it: snapped to 0 within kSnap dx; of whole tets, -dx or just above 0.
    double seenPhi(Coord voxel) const;
    /// Was the voxel node material when the mesh was made?
    bool wasMaterial(Coord voxel) const { return rest_(voxel) < 0; }

    const std::vector<Cell>& cells() const { return cells_; }
    const std::vector<CellElement>& elements() const override { return elements_; }
    const CellStencil& stencil(CellShape shape) const { return cellStencil_[std::size_t(shape)]; }
    std::size_t nodeCount() const override { return nodes_.size(); }
    /// Lattice coordinates of each node (copies share theirs), in a fixed order.
    const std::vector<Coord>& nodes() const { return nodes_; }
    std::span<const Coord> latticeCoords() const override { return nodes_; }
    double spacing() const override { return lattice_.spacing(); }
    double voxelSize() const override { return lattice_.voxelSize; }
    Vec3 restPosition(std::size_t node) const override { return lattice_.spacing() * nodes_[node].toVec(); }
    /// Index of the cell at lattice coordinates, or -1.
    std::int32_t cellAt(Coord cell) const { return cellIndex_(cell); }

    using BodyMesh::volume;
    double volume() const override { return volume_; }
    EmbeddedSurface surface() const override;
    PhiTets phiTets(double depth) const override;
    std::vector<Coord> voxelsAbove(std::span<const double> density, double threshold) const override;
    void addTetsRound(Coord voxel, std::vector<TetShare>& tets) const override;

protected:
    std::vector<std::uint32_t> elementsRound(const Vec3& X) const override;

private:
    /// The copies of one lattice node: the class of each star vertex (-1: no material there).
    struct NodeClasses {
        std::vector<std::int32_t> label;
        int count = 0;
    };
    /// Of each sub-tet of a cell at rest: its true volume over that of the linear cut; of one without a vertex inside,
    /// over that of the sub-tet.
    struct Corrections {
        std::vector<double> factor;
        std::vector<std::uint8_t> attached;  // of those: faces with material, bit a opposite to vertex a; often empty
    };
    /// A lattice node before and after its copies were counted again. Before: no label where there was one copy.
    struct Reclassified {
        std::uint32_t latticeNode = 0;
        NodeClasses before, now;
    };
    /// Old and new ids of the nodes.
    struct Renumbering {
        std::vector<std::uint32_t> previous;  // of each new node: the old node it comes from
        std::vector<std::uint32_t> now;  // of each old node: its new id, unless its lattice node was classified again;
                                         // empty when no id has changed
    };
    /// New elements of some cells.
    struct Regrouped {
        std::vector<std::uint32_t> cells;  // rising
        std::vector<std::uint32_t> first;  // of each cell: its first in `elements`; one more entry at the end
        std::vector<CellElement> elements;
    };

    void findCells();
    void findLatticeNodes();
    void sortByPatch(std::vector<Coord>& coords) const;
    Coord patchOf(Coord cell) const;
    std::vector<std::uint32_t> cellsTouching(const std::vector<Coord>& voxels) const;
    std::vector<std::uint32_t> latticeNodesTouching(const std::vector<Coord>& voxels) const;
    std::vector<std::uint32_t> cutCells(const std::vector<std::uint32_t>& cells);
    bool cutCell(Cell& cell, std::vector<double>& phi) const;
    void seenPhi(Coord base, std::span<const Coord> offsets, std::vector<double>& phi) const;

    const StarStencil& star(Coord node) const { return starStencil_[std::size_t((node.x + node.y + node.z) & 1)]; }
    double seen(double phi) const;
    Corrections correctionsOf(const Cell& cell, TrueShare& share) const;
    void correct(const RestShape& shape);
    bool isAttached(const Cell& cell, std::size_t subTet) const;
    bool hasAttached(Coord cell) const;
    int anchorOf(Coord voxel) const;
    std::vector<AttachedTet> attachedTets(Coord node) const;
    NodeClasses classify(Coord node) const;
    std::vector<Reclassified> reclassify(const std::vector<std::uint32_t>& latticeNodes);
    Renumbering renumber(const std::vector<Reclassified>& changed);
    void numberNodes();

    void addCellsRound(const std::vector<std::uint32_t>& latticeNodes, std::vector<std::uint32_t>& cells) const;
    Regrouped regroup(std::vector<std::uint32_t> cells);
    CellElement wholeElement(const Cell& cell) const;
    void groupPieces(Cell& cell, std::vector<double>& phi, std::vector<CellElement>& elements) const;
    PreviousElements previousElements(const Regrouped& regrouped, std::span<const std::uint32_t> previousNode) const;
    void placeElements(const Regrouped& regrouped, const Renumbering& numbering);
    void makeRoom(const Regrouped& regrouped);
    void renumberCells(std::size_t begin);

    Lattice lattice_;
    std::array<CellStencil, 3> cellStencil_;  // by CellShape
    std::array<StarStencil, 2> starStencil_;  // by parity of the node
    NodeField<float> phi_, rest_;
    std::vector<Corrections> corrections_;  // the first is of no cell

    std::vector<Cell> cells_;
    NodeField<std::int32_t> cellIndex_;
    std::vector<Coord> latticeNodes_;  // corners of the cells, in a fixed order
    NodeField<std::int32_t> latticeIndex_;
    std::vector<std::uint16_t> copies_;     // of each lattice node
    std::vector<std::uint32_t> firstNode_;  // id of copy 0 of each lattice node
    // By lattice node, of those with several copies; never walked.
    std::unordered_map<std::uint32_t, NodeClasses> classes_;
    std::vector<Coord> nodes_;
    std::vector<CellElement> elements_;
    double volume_ = 0;  // m^3
};

}  // namespace vdbfrac::tetmesh
