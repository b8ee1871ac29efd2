#include <vdbfrac/lab/samples/cantilever.h>

#include <cmath>

namespace vdbfrac::lab {

Bar::Bar(int slenderness, int thick, tetmesh::Lattice::Kind kind)
    : block({slenderness * thick, thick, thick}, 1. / thick, kind),
      length(slenderness * thick),
      endArea(nodalAreas(block, [this](Coord c) { return c.x == length; })),
      boundary(clamped(block, [](Coord c) { return c.x == 0; }))
{
}

void Bar::loadEnd(const Vec3& force)
{
    for (std::size_t i = 0; i < endArea.size(); ++i) boundary.force[i] = endArea[i] * force;
}

Vec3 Bar::endDisplacement(const solver::State& state) const
{
    Vec3 u;
    for (int d = 0; d < 3; ++d)
        u[d] =
            weightedMean(endArea, [&](std::size_t i) { return state.x[i][d] - block.h * block.nodes[i].toVec()[d]; });
    return u;
}

double deflectionRatio(const Cantilever& c)
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

}  // namespace vdbfrac::lab
