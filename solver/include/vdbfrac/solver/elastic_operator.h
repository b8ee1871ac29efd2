// Elastic energy, its gradient, its tangent as an operator, over all elements; parallel by patches.
//
// A patch is a block of lattice cells with a numbering of its nodes of its own: it reads its nodes into vectors that
// fit a core's cache, works through its cells eight at a time, and writes its sums to slots of its own. Then each node
// adds up its slots in a fixed order. So nothing is scattered across threads, and the bits do not depend on them.
#pragma once

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/coupling.h>
#include <vdbfrac/solver/material.h>
#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/tet_field.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// Where material flows (docs/physics.md). Of an element with the shear energy density mu n^2, n = |dev e|, it is
/// beyond the strain y
///   mu (n^2 - c (n - y)^2)
/// which holds what is stored and what flows within the step: its derivative is the stress that is left.
struct Yield {
    double first = kInfinity;    ///< y of all elements, or
    std::vector<double> strain;  ///< of each; both read when the operator is made
    double share = 1;            ///< c in [0, 1]: of what is beyond y flows in the step; read at each evaluation

    double of(std::size_t element) const { return strain.empty() ? first : strain[element]; }
};

/// One body's share of a system.
struct ElementSet {
    std::span<const tetmesh::CellElement> elements;
    std::span<const Coord> nodes;  ///< lattice coordinates of its nodes; empty without a lattice
    std::uint32_t firstNode = 0;   ///< of the system: node 0 of the body
    Material material;
    std::span<const tetmesh::TetGradients> gradients = {};  ///< of each element where they are tets of any shape
    /// Fp^-1 of each tet, det 1: the energy is that of F Fp^-1. Null or I: no flow, which costs nothing. Read when the
    /// operator is made. Coarse lattices of multigrid do without it.
    const tetmesh::TetField<Mat3>* inverseFlow = nullptr;
    /// Factor on the stiffness of each tet, by tetEntry(); empty: 1, which costs nothing. Read as inverseFlow is. Means
    /// over the tets of a cell weigh by it.
    std::span<const float> stiffness = {};
    const Yield* yield = nullptr;  ///< null: it never flows, which costs nothing
};

enum class Volumetric { cell, none };  ///< cell: mean dilatation over the tets of a cell, against locking

/// The discrete energy; from a Volumetric alone it is corotational.
struct Elasticity {
    Volumetric volumetric;
    Strain strain;
    /// Share of the deviatoric energy that is taken from the mean deformation gradient of a cell, in [0, 1): tets alone
    /// are too stiff in bending and torsion. Only with Volumetric::cell.
    double meanStrain;

    Elasticity(Volumetric v, Strain s = Strain::corotational, double mean = 0)
        : volumetric(v), strain(s), meanStrain(v == Volumetric::cell ? mean : 0)
    {
    }
};

struct ElasticWork {
    std::int64_t evaluations = 0;    ///< passes over the elements for energy, gradient and tangent
    std::int64_t evaluatedTets = 0;  ///< tets in them
    std::int64_t products = 0;
    std::int64_t productTets = 0;
    std::int64_t robustTets = 0;  ///< tets whose polar decomposition needed an SVD
};

using Vec3f = Eigen::Vector3f;

/// The elements of a lattice that make up each element of the lattice of twice its spacing.
struct FinerElements {
    std::vector<std::uint32_t> start;  ///< of each coarse element, and the end
    std::vector<std::uint32_t> children;
};

struct TetTangent;
struct LaneYielding;

/// The tangent at one x: rotation and twist operator of every tet, or their means over each cell. Where material yields
/// it has what is left of the shear modulus and, but in means, less stiffness the way it flows.
class Tangent {
public:
    Tangent();
    ~Tangent();
    Tangent(Tangent&&) noexcept;
    Tangent& operator=(Tangent&&) noexcept;

    std::size_t bytes() const;

private:
    friend class ElasticOperator;
    void resize(std::size_t tets);
    /// Nothing yields, of as many batches; of none: without the table.
    void resetYielding(std::size_t batches);

    std::unique_ptr<TetTangent[]> tets_;        ///< of eight elements each
    std::unique_ptr<LaneYielding[]> yielding_;  ///< by batch; null: nothing yields
    bool ofCells_ = false;
    std::size_t count_ = 0, capacity_ = 0, yieldingCount_ = 0;
    double share_ = 0;
};

/// Sum of what the patches have for node n, in a fixed order.
template <class V>
struct NodeSums {
    const V* slot;
    const std::uint32_t *start, *slots, *contiguous;  // SlotSums in kernel.h

    V operator()(std::size_t n) const
    {
        std::uint32_t s = start[n];
        const std::uint32_t end = start[n + 1];
        if (s == end) return V::Zero();
        V sum = slot[slots[s]];
        while (++s < end) sum += slot[slots[s]];
        return sum;
    }
};

/// What multiply() returns: H u is left in pieces that are added up where it is wanted.
template <class V>
struct Product {
    double energy = 0;  ///< u.H u
    NodeSums<V> sums;   ///< H u of a node; until the operator is next called
};

/// One call at a time: products and evaluations share scratch memory.
class ElasticOperator {
public:
    /// `h` [m]: lattice spacing of all sets; `nodeCount`: of the system. What the sets refer to must live as long.
    ElasticOperator(std::span<const ElementSet> sets, std::size_t nodeCount, double h, Elasticity elasticity);
    ~ElasticOperator();
    ElasticOperator(ElasticOperator&&) noexcept;
    ElasticOperator& operator=(ElasticOperator&&) noexcept;

    std::span<const ElementSet> sets() const;
    double h() const;  ///< m
    Elasticity elasticity() const;
    Volumetric volumetric() const { return elasticity().volumetric; }
    std::size_t nodeCount() const;
    std::int64_t tetCount() const;
    /// Lumped mass of each node [kg]: a quarter of each tet's.
    std::span<const double> mass() const;
    /// Magnitude of each node's diagonal block of K [N/m], from its material volume alone: scales rounding errors.
    std::span<const double> stiffness() const;
    /// Bound of the angular frequencies [1/s] of small vibrations of the rest shape: the largest of any tet alone
    /// (Irons & Treharne 1971). Explicit schemes are stable up to the time step 2 over it.
    double highestFrequency() const;

    /// Leaves out the patches all of whose nodes are marked, until the next call; empty: none. Marked nodes neither
    /// move nor answer: the energy of these patches stays what it is, their gradient and products are 0.
    void setAsleep(std::span<const std::uint8_t> nodes);
    bool hasAsleep() const;  ///< is a patch left out?

    /// Elastic energy [J] at x [m]; adds its gradient [N] to `gradient` and keeps the exact tangent in `tangent`
    /// where these are given (not empty, not null). The tangent then also has `share` times linear elasticity in the
    /// rotated frame of each tet, which costs a product nothing.
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient, Tangent* tangent, double share = 0) const;
    /// Energy density of every tet [J/m^3]: entry 6 e + t for tet t of element e (elements counted through all sets); 0
    /// for a tet without material. `density` is given its size. Those of patches that are left out are 0, or what
    /// they are with `all`.
    void energyDensities(std::span<const Vec3> x, std::vector<double>& density, bool all = false) const;
    /// n of each element (Yield), through all sets; 0 without material, and in patches that are left out.
    void shearStrains(std::span<const Vec3> x, std::vector<double>& n) const;

    /// Makes the tangent positive semidefinite: clamps the twist eigenvalues (Smith et al. 2019, section 4).
    void project(Tangent& tangent) const;
    /// Makes the tangent that of linear elasticity in the rotated frame of each tet ("stiffness warping"; Mueller &
    /// Gross 2004): semidefinite, free of stress terms. With its `share` more of it, if it has one.
    void warp(Tangent& tangent) const;

    /// H u, where H is the tangent and, if there are any, `blocks` of nodes with material. V is Vec3, or Vec3f for a
    /// product in single precision.
    template <class V>
    Product<V> multiply(const Tangent& tangent, std::span<const V> u, const NodeBlocks* blocks = nullptr) const;
    /// out += H u.
    void addProduct(const Tangent& tangent, std::span<const Vec3> u, std::span<Vec3> out,
                    const NodeBlocks* blocks = nullptr) const;
    /// The 3x3 diagonal blocks of K, with NodeBlocks::damping, as xx, yy, zz, yz, zx, xy, left in pieces like a
    /// product.
    using PackedBlock = Eigen::Matrix<double, 6, 1>;
    NodeSums<PackedBlock> diagonal(const Tangent& tangent, const NodeBlocks* blocks = nullptr) const;

    /// K of one element (counted through all sets), rows and columns 3 corner + axis [N/m].
    using ElementMatrix = Eigen::Matrix<double, 24, 24>;
    ElementMatrix elementMatrix(const Tangent& tangent, std::size_t element) const;
    /// Makes `cells` a tangent near `tangent`, which is of every tet: positive semidefinite, with one rotation and one
    /// twist operator for all tets of a cell. Products with it need a sixth of the memory and half of the operations:
    /// for preconditioners.
    void averageTets(const Tangent& tangent, Tangent& cells) const;
    /// The same of this operator, on a lattice of twice the spacing of `fine`, from the means over the finer cells.
    void averageCells(const ElasticOperator& fine, const Tangent& fineCells, const FinerElements& finer,
                      Tangent& cells) const;

    const ElasticWork& work() const;
    std::size_t bytes() const;  ///< held by patches, slots and nodes; a Tangent is apart
    /// What a product has to move at least, summed up in the caller's pass over the nodes: the tangent, the tables of
    /// the patches, u, and the slots written and read.
    std::size_t productBytes() const;
    std::size_t productBytesWritten() const;  ///< of these: the slots

private:
    struct Data;
    std::unique_ptr<Data> data_;
};

}  // namespace vdbfrac::solver
