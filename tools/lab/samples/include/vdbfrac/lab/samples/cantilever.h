// Bars of whole cells held at one end, and how far the tip of a cantilever goes.
#pragma once

#include <vdbfrac/lab/samples/loads.h>

#include <limits>

namespace vdbfrac::lab {

/// As the time step of backward Euler: asks for the static equilibrium.
inline constexpr double kStatic = std::numeric_limits<double>::infinity();

/// A bar of `cells` along x, `thick` cells across a section of 1 x 1, held at x = 0.
struct Bar {
    Block block;
    int length;
    std::vector<double> endArea;
    solver::Boundary boundary;

    Bar(int slenderness, int thick, tetmesh::Lattice::Kind kind = tetmesh::Lattice::Kind::six);

    void loadEnd(const Vec3& force);
    Vec3 endDisplacement(const solver::State& state) const;
};

struct Cantilever {
    tetmesh::Lattice::Kind kind;
    solver::Volumetric volumetric;
    int thick;  ///< cells
    double nu;
    double expected = 0;  ///< tip deflection / Timoshenko
};

/// Tip deflection of an 8 x 1 x 1 cantilever under a small end load, over Timoshenko's. NaN when the solve is capped.
double deflectionRatio(const Cantilever& c);

}  // namespace vdbfrac::lab
