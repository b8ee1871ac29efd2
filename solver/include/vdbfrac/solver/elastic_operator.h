// Elastic energy, its gradient, its tangent as an operator, over all elements; parallel by patches.
//
// A patch is a block of lattice cells with a numbering of its nodes of its own: it reads its nodes into vectors that
// fit a core's cache, works through its cells eight at a time, and writes its sums to slots of its own. Then each node
// adds up its slots in a fixed order. So nothing is scattered across threads, and the bits do not depend on them.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/material.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// One body's share of a system.
struct ElementSet {
    std::span<const tetmesh::CellElement> elements;
    std::span<const Coord> nodes;     ///< lattice coordinates of its nodes
    std::uint32_t firstNode = 0;      ///< of the system: node 0 of the body
    Material material;
};

enum class Volumetric { cell, none };  ///< cell: mean dilatation over the tets of a cell, against locking

struct ElasticWork {
    std::int64_t evaluations = 0;    ///< passes over the elements for energy, gradient and tangent
    std::int64_t evaluatedTets = 0;  ///< tets in them
    std::int64_t products = 0;
    std::int64_t productTets = 0;
    std::int64_t robustTets = 0;     ///< tets whose polar decomposition needed an SVD
};

/// The tangent at one x: rotation and twist operator of every tet.
class Tangent {
public:
    Tangent();
    ~Tangent();
    Tangent(Tangent&&) noexcept;
    Tangent& operator=(Tangent&&) noexcept;

private:
    friend class ElasticOperator;
    struct Data;
    std::unique_ptr<Data> data_;
};

class ElasticOperator {
public:
    /// `h` [m]: lattice spacing of all sets; `nodeCount`: of the system.
    ElasticOperator(std::span<const ElementSet> sets, std::size_t nodeCount, double h, Volumetric volumetric);
    ~ElasticOperator();
    ElasticOperator(ElasticOperator&&) noexcept;
    ElasticOperator& operator=(ElasticOperator&&) noexcept;

    std::size_t nodeCount() const;
    std::int64_t tetCount() const;
    /// Lumped mass of each node [kg]: a quarter of each tet's.
    std::span<const double> mass() const;
    /// Magnitude of each node's diagonal block of K [N/m], from its material volume alone: scales rounding errors.
    std::span<const double> stiffness() const;

    /// Elastic energy [J] at x [m]; adds its gradient [N] to `gradient` and keeps the exact tangent in `tangent`
    /// where these are given (not empty, not null).
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient, Tangent* tangent) const;
    /// Energy density of every tet [J/m^3]: entry 6 e + t for tet t of element e (elements counted through all sets).
    std::vector<double> energyDensities(std::span<const Vec3> x) const;

    /// Makes the tangent positive semidefinite: clamps the twist eigenvalues (Smith et al. 2019, section 4).
    void project(Tangent& tangent) const;
    /// Makes the tangent that of linear elasticity in the rotated frame of each tet ("stiffness warping"; Mueller & Gross
    /// 2004): semidefinite, free of stress terms.
    void warp(Tangent& tangent) const;
    /// out += K u.
    void addProduct(const Tangent& tangent, std::span<const Vec3> u, std::span<Vec3> out) const;
    /// Adds the 3x3 diagonal blocks of K.
    void addDiagonal(const Tangent& tangent, std::span<Mat3> blocks) const;

    const ElasticWork& work() const;
    std::size_t bytes() const;  ///< held by patches and slots

private:
    struct Data;
    std::unique_ptr<Data> data_;
};

}  // namespace vdbfrac::solver
