// What a step of backward Euler minimises: Phi(x) of backward_euler.h, with its gradient, its tangent, and what
// rounding does to them. Not installed.
#pragma once

#include "loose_parts.h"

#include <vdbfrac/solver/backward_euler.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// Phi at one x, with the sizes that tell how small its gradient has to be.
struct Point {
    std::vector<Vec3> x, gradient;
    double phi = 0;         ///< J
    double elastic = 0;     ///< J
    double phiNoise = 0;    ///< J: what rounding alone can change phi by
    double norm = 0;        ///< N: of the gradient at free nodes
    double forceScale = 0;  ///< N: largest of inertia, elastic and outer force
    double noise = 0;       ///< N: what rounding alone can leave of the gradient
};

class Objective {
public:
    void rebind(const ElasticOperator& elastic);
    /// For the step from `state`.
    void begin(const State& state, double dt, const System& system);

    const ElasticOperator& elastic() const { return *elastic_; }
    double dt() const { return dt_; }  ///< s
    const Boundary& boundary() const { return *boundary_; }
    std::span<const Vec3> predicted() const { return predicted_; }  ///< x~ [m]
    std::span<const std::uint8_t> fixed() const { return fixed_; }  ///< nodes that do not answer: held or frozen
    std::size_t frozenNodes() const { return frozenNodes_; }
    CouplingsOf couplings() const { return {couplings_, scalars_}; }

    /// All about p.x; system() and addProduct() belong to this x then.
    void evaluate(Point& p);
    /// Farthest that the gradient would take a free node against inertia and the stiffness of its own tets and
    /// couplings [m]; p.x was evaluated last.
    double farthest(const Point& p);
    /// Lets potentials leave out what adds nothing at an iterate.
    void prune(std::span<const Vec3> x);
    /// Lets potentials bring themselves up to date at a solution; has one changed?
    bool refresh(std::span<const Vec3> x);
    /// J that the elastic forces at the x last evaluated take along the way from `from`; `gradient`: of Phi there.
    double elasticWork(std::span<const Vec3> x, std::span<const Vec3> gradient, std::span<const Vec3> from) const;
    /// Takes the held nodes to their targets.
    void hold(Point& p) const;
    /// The free node with the largest gradient.
    std::uint32_t worstNode(const Point& p) const;
    /// Farthest that a held node is from where it would have gone by itself [m].
    double jump() const;
    /// Shifts each part without fixed nodes by what zeroes its summed gradient: internal forces cancel in the sum and
    /// do not change under a shift, so only inertia answers. Sums run over nodes in order.
    void balanceMomentum(Point& p);

    LinearSystem system();
    /// out += Hessian u, but for inertia.
    void addProduct(std::span<const Vec3> u, std::span<Vec3> out);
    void projectTangent() { elastic_->project(tangent_); }
    void warpTangent() { elastic_->warp(tangent_); }
    std::size_t bytes() const;

private:
    void freezeLooseParts();
    void measureForces(Point& p, double outerEnergy);
    const NodeBlocks* blocks();

    const ElasticOperator* elastic_ = nullptr;
    Tangent tangent_;
    std::vector<Coupling> couplings_;  // at the x of the tangent
    std::vector<ScalarCoupling> scalars_;
    NodeBlocks blocks_;  // of them, when blocksMade_
    bool blocksMade_ = false;
    std::vector<Vec3> predicted_, outer_;
    LooseParts parts_;
    struct Balance {
        Vec3 force;
        double inertia;
    };
    std::vector<Balance> balance_;  // of each part

    // Of the step at hand.
    double dt_ = 0, inertia_ = 0;  // s, 1/s^2
    HessianShares shares_;
    std::span<Potential* const> potentials_;
    const Boundary* boundary_ = nullptr;
    std::vector<std::uint8_t> fixed_;
    std::size_t frozenNodes_ = 0;
};

}  // namespace vdbfrac::solver
