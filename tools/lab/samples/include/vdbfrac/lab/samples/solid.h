// Solids of one or more bodies as linear systems: what they are made of, how they are held, at which x.
#pragma once

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/linear_solver.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::lab {

/// A ball of radius `r` voxels cut by the lattice.
tetmesh::CutMesh cutBall(const tetmesh::Lattice& lattice, double r);

/// A linear system with all that it refers to. It is taken at a turned and stretched x, where tangents are definite,
/// shaken a little so that no two tets are alike.
class Solid {
public:
    struct Body {
        Block block;
        solver::Material material;
    };
    struct Conditions {
        std::function<bool(Coord)> held;  ///< by lattice coordinates
        double massFactor = 0;            ///< 1/s^2
        solver::Volumetric volumetric = solver::Volumetric::cell;
        double share = 0;  ///< of linear elasticity, as damping adds it
        double stretch = 1.05;
        double shake = .02;  ///< lattice spacings
    };

    Solid(std::vector<Body> bodies, const Conditions& conditions);
    Solid(const Solid&) = delete;  // the sets refer to the bodies

    const solver::ElasticOperator& elastic() const { return elastic_; }
    solver::Tangent& tangent() { return tangent_; }
    const std::vector<Vec3>& x() const { return x_; }
    const std::vector<std::uint8_t>& fixed() const { return fixed_; }
    std::size_t nodeCount() const { return x_.size(); }
    solver::LinearSystem system() const { return {elastic_, tangent_, massFactor_, fixed_}; }

    /// A u, 0 at fixed nodes; u must be 0 there.
    std::vector<Vec3> product(std::span<const Vec3> u) const;

    /// Random forces on the free nodes, in proportion to the stiffness there: slivers get little.
    std::vector<Vec3> randomForces(unsigned seed) const;

private:
    std::vector<Body> bodies_;
    std::vector<solver::ElementSet> sets_;
    double massFactor_;
    solver::ElasticOperator elastic_;
    solver::Tangent tangent_;
    std::vector<Vec3> x_;
    std::vector<std::uint8_t> fixed_;
};

inline const solver::Material kGel = solver::makeMaterial(1e5, .3, 1000);

inline bool onFloor(Coord c) { return c.z == 0; }

std::unique_ptr<Solid> makeSolid(Block block, const Solid::Conditions& conditions,
                                 const solver::Material& material = kGel);

std::vector<Vec3> difference(std::span<const Vec3> a, std::span<const Vec3> b);
double norm(std::span<const Vec3> a);

}  // namespace vdbfrac::lab
