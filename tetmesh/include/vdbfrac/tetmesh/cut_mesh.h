// The material as simulation elements: lattice cells cut by phi, with nodes duplicated where material is apart.
//
// phi lives on voxel nodes, h = m dx apart from the lattice. Every sub-tet with material has its own copies of its
// parent tet's nodes; sub-tets that share a face with material on it share the copies of the lattice nodes they have
// in common (union-find in the star of each lattice node). The classes are the nodes of the simulation.
// phi only grows, so classes only split: a new class lies in exactly one old class.
// Source: Hegemann et al. 2013, section 4; node duplication after Teran et al. 2005 / Sifakis et al. 2007.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// Tets of one lattice cell that agree on the cell's corner nodes: the unit the solver works on.
struct CellElement {
    std::array<std::uint32_t, kCorners> node{};  ///< a corner no tet uses names some node of the element
    std::array<double, kMostTets> fraction{};    ///< material volume / tet volume of each tet; 0: the tet is not here
    CellShape shape = CellShape::six;
    std::uint32_t patch = 0;                     ///< elements of one block of 8^3 cells share it and are consecutive
};

/// The material part of one sub-tet of a cut cell.
struct Piece {
    std::uint16_t subTet = 0;   ///< index into the cell stencil
    std::uint16_t element = 0;  ///< of the cell's elements
    TetCut cut;
};

/// A lattice cell that holds material.
struct Cell {
    Coord coord;                ///< lattice coordinates of corner 0
    std::uint32_t patch = 0;
    bool whole = true;          ///< all its voxel nodes are material: one element, no pieces kept
    std::uint32_t firstElement = 0, elements = 1;
    std::vector<Piece> pieces;  ///< of a cell that is not whole, by sub-tet
};

/// What an update touched and how to carry node data over.
struct CutUpdate {
    std::vector<std::uint32_t> previousNode;  ///< of each new node: the old node whose x and v it takes
    std::int64_t changedVoxels = 0;           ///< voxel nodes whose phi the cut sees differently
    std::int64_t cutCells = 0;                ///< cells cut again: exactly those with such a voxel node
    std::int64_t classifiedNodes = 0;         ///< lattice nodes whose copies were counted again
    bool topologyChanged = false;             ///< nodes or their sharing may differ
};

class CutMesh {
public:
    CutMesh() = default;
    /// Cuts everything. phi [m] on voxel coordinates; its box must hold every material voxel and two layers more.
    CutMesh(Lattice lattice, NodeField<float> phi);

    /// Takes new values of phi [m] (none lower than before) and re-cuts only the cells whose view of phi changed.
    /// The result equals a CutMesh made from the new phi, to the bit.
    CutUpdate update(std::span<const std::pair<Coord, float>> newPhi);

    const Lattice& lattice() const { return lattice_; }
    const NodeField<float>& phi() const { return phi_; }
    /// phi as the cut sees it: snapped to 0 within kSnap dx.
    double seenPhi(Coord voxel) const;
    /// Was the voxel node material when the mesh was made?
    bool wasMaterial(Coord voxel) const { return rest_(voxel) < 0; }

    const std::vector<Cell>& cells() const { return cells_; }
    const std::vector<CellElement>& elements() const { return elements_; }
    const CellStencil& stencil(CellShape shape) const { return cellStencil_[std::size_t(shape)]; }
    std::size_t nodeCount() const { return nodes_.size(); }
    /// Lattice coordinates of each node (copies share theirs), in a fixed order.
    const std::vector<Coord>& nodes() const { return nodes_; }
    Vec3 restPosition(std::size_t node) const { return lattice_.spacing() * nodes_[node].toVec(); }
    /// Index of the cell at lattice coordinates, or -1.
    std::int32_t cellAt(Coord cell) const { return cellIndex_(cell); }

    /// Material volume [m^3] of an element.
    double volume(const CellElement& element) const;
    double volume() const;

private:
    /// The copies of one lattice node: the class of each star vertex (-1: no material there).
    struct NodeClasses {
        std::vector<std::int16_t> label;
        int count = 0;
    };
    using ClassMap = std::map<Coord, NodeClasses>;  // only lattice nodes with several copies

    void findCells();
    void findLatticeNodes();
    void sortByPatch(std::vector<Coord>& coords) const;
    Coord patchOf(Coord cell) const;
    void cutCell(Cell& cell) const;
    NodeClasses classify(Coord node) const;
    int classOf(Coord node, Coord voxel) const;
    std::vector<std::uint32_t> cellsTouching(const std::vector<Coord>& voxels) const;
    std::vector<std::uint32_t> latticeNodesTouching(const std::vector<Coord>& voxels) const;
    void reclassify(const std::vector<std::uint32_t>& latticeNodes);
    std::vector<std::uint32_t> renumber(const std::vector<std::uint32_t>& dirty, const ClassMap& before);
    void numberNodes();
    void dropEmptyCells();
    void gatherElements();
    std::vector<CellElement> groupPieces(Cell& cell) const;
    CellElement wholeElement(const Cell& cell) const;
    std::uint32_t nodeId(Coord node, int copy) const { return firstNode_[std::size_t(latticeIndex_(node))] + std::uint32_t(copy); }

    Lattice lattice_;
    std::array<CellStencil, 3> cellStencil_;  // by CellShape
    std::array<StarStencil, 2> starStencil_;  // by parity of the node
    NodeField<float> phi_, rest_;

    std::vector<Cell> cells_;
    NodeField<std::int32_t> cellIndex_;
    std::vector<Coord> latticeNodes_;           // corners of the cells, in a fixed order
    NodeField<std::int32_t> latticeIndex_;
    std::vector<std::uint16_t> copies_;         // of each lattice node
    std::vector<std::uint32_t> firstNode_;      // id of copy 0 of each lattice node
    ClassMap classes_;
    std::vector<Coord> nodes_;
    std::vector<CellElement> elements_;
};

}  // namespace vdbfrac::tetmesh
