// The material of a body as elements of a simulation, cut by phi: what a lattice and a Delaunay mesh have in common.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/embedded_surface.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/phi_tets.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// Tets of one lattice cell that agree on the cell's corner nodes, or one tet of any shape: the unit the solver works
/// on.
struct CellElement {
    std::array<std::uint32_t, kCorners> node{};  ///< a corner no tet uses names some node of the element
    std::array<double, kMaxTets> fraction{};     ///< material volume / tet volume of each tet; 0: the tet is not here
    CellShape shape = CellShape::six;
    std::uint32_t patch = 0;  ///< elements of one block of 8^3 cells share it and are consecutive
};

/// The nodes of a tet of an element.
std::array<std::uint32_t, 4> tetNodes(const CellElement& element, std::uint32_t tet);

/// Where the elements of a mesh come from that was cut again. Classes of nodes only split, so each tet of a new element
/// lies in the same tet of exactly one old element.
struct PreviousElements {
    /// Elements that are what they were, but for the numbers of their nodes.
    struct Kept {
        std::uint32_t first = 0, old = 0, count = 0;
    };
    /// An element of a cell that was cut again.
    struct Recut {
        std::uint32_t element = 0;
        std::array<std::uint32_t, kMaxTets> old{};  ///< of each tet with material: the element it was in
    };
    /// An old element of such a cell, as it was.
    struct Replaced {
        std::uint32_t old = 0;
        CellElement element;       ///< with old numbers of nodes
        TetGradients gradients{};  ///< of a tet of any shape
    };
    std::vector<Kept> kept;          ///< rising, as new and as old elements
    std::vector<Recut> recut;        ///< rising
    std::vector<Replaced> replaced;  ///< rising
};

/// What an update touched and how to carry data over.
struct CutUpdate {
    std::vector<std::uint32_t> previousNode;  ///< of each new node: the old node whose x and v it takes
    PreviousElements previousElement;
    std::int64_t changedVoxels = 0;    ///< voxel nodes whose phi has changed, as the cut sees it on a lattice
    std::int64_t cutCells = 0;         ///< cells or tets cut again: exactly those that see such a change
    std::int64_t classifiedNodes = 0;  ///< points of the mesh whose copies were counted again
    std::int64_t groupedCells = 0;     ///< cells or tets that were made to elements again
    bool topologyChanged = false;      ///< nodes or their sharing may differ
};

/// phi [m] of the true shape of a body at rest, at points X [m]: what lies between the voxels. Called from any thread.
using RestShape = std::function<void(std::span<const Vec3> X, std::span<double> phi)>;

/// Energy density [J/m^3] of tet t of an element.
using TetEnergy = std::function<double(std::uint32_t element, int tet)>;

/// A tet and its material round a voxel node p: the integral of N_p over that, in units of a voxel.
struct TetShare {
    std::uint32_t element = 0;
    int tet = 0;
    double volume = 0;
};

/// Material round a voxel node p: the integral of its trilinear or nodal function N_p over it, and of N_p times an
/// energy density, in units of a voxel.
struct NodalShare {
    double volume = 0, energy = 0;
};

/// A point of the material: in which tet of which element, and as a sum over its nodes.
struct MaterialPoint {
    std::uint32_t element = 0, tet = 0;
    EmbeddedPoint point;
};

class BodyMesh {
public:
    virtual ~BodyMesh() = default;

    /// Takes new values of phi [m] (none lower than before) and re-cuts only what sees a change. The result equals a
    /// mesh made from the new phi, to the bit.
    virtual CutUpdate update(std::span<const VoxelPhi> newPhi) = 0;

    virtual const NodeField<float>& phi() const = 0;      ///< on voxels [m]
    virtual const NodeField<float>& restPhi() const = 0;  ///< as it was when the mesh was made
    virtual const std::vector<CellElement>& elements() const = 0;
    virtual std::span<const TetGradients> gradients() const
    {
        return {};
    }  ///< of each element that is a tet of any shape
    virtual std::size_t nodeCount() const = 0;
    virtual std::span<const Coord> latticeCoords() const { return {}; }  ///< of each node; empty without a lattice
    virtual Vec3 restPosition(std::size_t node) const = 0;               ///< m
    virtual double spacing() const = 0;                                  ///< h: typical edge of a tet [m]
    virtual double voxelSize() const = 0;                                ///< dx [m]

    virtual double volume() const = 0;  ///< of the material [m^3]
    /// Material volume [m^3] of an element.
    double volume(const CellElement& element) const;

    /// Closed surface of the material, normals outward.
    virtual EmbeddedSurface surface() const = 0;
    /// The tets with material that are no deeper below the surface than `depth` [m] with all of their corners.
    virtual PhiTets phiTets(double depth) const = 0;

    /// Voxel nodes of all tets whose energy density exceeds `threshold`, sorted, each once. No other voxel node can
    /// have a nodal energy above it. `density`: entry 6 e + t for tet t of element e.
    virtual std::vector<Coord> voxelsAbove(std::span<const double> density, double threshold) const = 0;
    /// Adds the tets with material round a voxel node.
    virtual void addTetsRound(Coord voxel, std::vector<TetShare>& tets) const = 0;
    /// Calls visit(element, tet, volume) for each of them; not from within such a call.
    template <class Visit>
    void visitTets(Coord voxel, const Visit& visit) const
    {
        static thread_local std::vector<TetShare> tets;
        tets.clear();
        addTetsRound(voxel, tets);
        for (const TetShare& share : tets) visit(share.element, share.tet, share.volume);
    }
    NodalShare nodalShare(Coord voxel, const TetEnergy& energy) const;

    /// The tet with material that X [m, at rest] lies in. Of several, as on both sides of a crack: those that have one
    /// of the nodes `near`, where any are given; of them that with the most material, then the first.
    std::optional<MaterialPoint> locate(const Vec3& X, std::span<const std::uint32_t> near = {}) const;
    RestTet restTet(std::uint32_t element, std::uint32_t tet) const;
    /// X as a sum over the nodes of a tet, whether it lies in it or not.
    EmbeddedPoint embed(std::uint32_t element, std::uint32_t tet, const Vec3& X) const
    {
        return restTet(element, tet).embed(X);
    }

protected:
    /// Rising elements that hold all tets with X in them; others may be among them.
    virtual std::vector<std::uint32_t> elementsRound(const Vec3& X) const = 0;
};

/// Rest positions of all nodes [m].
std::vector<Vec3> restPositions(const BodyMesh& mesh);

}  // namespace vdbfrac::tetmesh
