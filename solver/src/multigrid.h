// W-cycle over lattices of twice the spacing, level by level. Not installed.
//
// Each coarse level is an elastic operator of its own: elements as coarsening.h makes them, with the material volume of
// the finer tets in each tet. All levels, the finest too, have one rotation and one twist operator for all tets of a
// cell, the means over the finer ones, made semidefinite: hardly worse to precondition with than the tangent itself, at
// a sixth of its memory and half of its arithmetic. On nested six-tet lattices with equal tangents this is the Galerkin
// operator; near nu = .5 the mean dilatation is taken over the coarse cell, which does not lock as the Galerkin
// operator would. Each level asks the next coarser one twice (W): coarse elements at the front of a crack join its
// sides, and once would let what each level misses there add up from level to level. A fixed node that has no coarse
// node in its place holds the coarse nodes round it by springs of its own stiffness.// Couplings are on every level,
// between the nodes that take their values from the coupled ones (Galerkin). Smoother: Chebyshev polynomial of the
// block-Jacobi iteration (Adams, Brezina, Hu, Tuminaro 2003); coarsest level: Cholesky. All but that in single
// precision: the W-cycle is the preconditioner of an iteration in double.
#pragma once

#include "block_diagonal.h"
#include "coarsening.h"

#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::solver {

class Multigrid {
public:
    /// Whether the operator has a lattice to coarsen.
    static bool fits(const ElasticOperator& elastic);
    explicit Multigrid(const ElasticOperator& elastic);  ///< one that fits
    ~Multigrid();

    /// For one system of the operator: tangents, diagonals and fixed nodes of all levels. False: a block or the
    /// coarsest level is not positive definite enough to precondition with.
    [[nodiscard]] bool setUp(const LinearSystem& system);
    /// The same where since setUp() only couplings have changed: tangents and fixed nodes of all levels stay.
    [[nodiscard]] bool couple(const LinearSystem& system);
    /// One W-cycle: result() for rightSide(), which is 0 at fixed nodes.
    void apply();
    std::span<Vec3f> rightSide();
    std::span<const Vec3f> result() const;

    int levels() const;
    std::size_t bytes() const;

private:
    struct Level;
    struct Coarsest;

    void weigh(Level& level, double massFactor);
    static float largestEigenvalue(Level& level);
    static void smooth(Level& level, bool fromZero);
    static void restrictResidual(Level& level, Level& coarse);
    bool factorCoarsest();
    void solveCoarsest(Level& level);
    void cycle(std::size_t l, bool fromZero);  // for the level's b, from 0 or from its x

    std::vector<std::unique_ptr<Level>> levels_;
    std::unique_ptr<Coarsest> coarsest_;
};

}  // namespace vdbfrac::solver
