// Bars of whole cells held at one end, and how far the tip of a cantilever goes.
#pragma once

#include "loads.h"

#include <cmath>
#include <limits>

namespace vdbfrac::test {

/// As the time step of backward Euler: asks for the static equilibrium.
inline constexpr double kStatic = std::numeric_limits<double>::infinity();

/// A bar of `cells` along x, `thick` cells across a section of 1 x 1, held at x = 0.
struct Bar {
    Block block;
    int length;
    std::vector<double> endArea;
    solver::Boundary boundary;

    Bar(int slenderness, int thick, tetmesh::Lattice::Kind kind = tetmesh::Lattice::Kind::six)
        : block({slenderness * thick, thick, thick}, 1. / thick, kind),
          length(slenderness * thick),
          endArea(nodalAreas(block, [this](Coord c) { return c.x == length; })),
          boundary(clamped(block, [](Coord c) { return c.x == 0; }))
    {
    }

    void loadEnd(const Vec3& force)
    {
        for (std::size_t i = 0; i < endArea.size(); ++i) boundary.force[i] = endArea[i] * force;
    }
    Vec3 endDisplacement(const solver::State& state) const
    {
        Vec3 u;
        for (int d = 0; d < 3; ++d)
            u[d] = weightedMean(endArea,
                                [&](std::size_t i) { return state.x[i][d] - block.h * block.nodes[i].toVec()[d]; });
        return u;
    }
};

struct Cantilever {
    tetmesh::Lattice::Kind kind;
    solver::Volumetric volumetric;
    int thick;  ///< cells
    double nu;
    double expected = 0;  ///< tip deflection / Timoshenko
};

/// Tip deflection of an 8 x 1 x 1 cantilever under a small end load, over Timoshenko's. NaN when the solve is capped.
inline double deflectionRatio(const Cantilever& c)
{
    constexpr double kLength = 8, kInertia = 1. / 12, kShearFactor = 5. / 6, kE = 1;
    constexpr double kForce = 1e-9;  // deflection 2e-6 of the thickness: far inside the linear range
    Bar bar(int(kLength), c.thick, c.kind);
    bar.loadEnd({0, -kForce, 0});
    const auto elastic = elasticOperator(bar.block, solver::makeMaterial(kE, c.nu, 1), c.volumetric);
    solver::State state = atRest(bar.block);
    const auto report = solver::stepBackwardEuler(elastic, state, kStatic, {{}, bar.boundary}, tightSettings());
    if (report.status != solver::StepStatus::converged) return std::numeric_limits<double>::quiet_NaN();
    const double G = kE / (2 * (1 + c.nu));
    const double timoshenko = kForce * (std::pow(kLength, 3) / (3 * kE * kInertia) + kLength / (kShearFactor * G));
    return -bar.endDisplacement(state).y() / timoshenko;
}

}  // namespace vdbfrac::test
