// A potential, its gradient and its couplings along a direction, beside central differences.
#pragma once

#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/solver/potential.h>

#include <span>
#include <vector>

namespace vdbfrac::test {

/// a + f b.
inline std::vector<Vec3> sum(std::span<const Vec3> a, double f, std::span<const Vec3> b)
{
    std::vector<Vec3> r(a.begin(), a.end());
    for (std::size_t i = 0; i < r.size(); ++i) r[i] += f * b[i];
    return r;
}

struct PotentialAlong {
    double energy = 0;           // J
    std::vector<Vec3> gradient;  // N
    std::vector<solver::Coupling> couplings;
    double slope = 0, slopeOfEnergy = 0;        // along u: of the gradient, and by differences
    double tangent = 0, tangentOfGradient = 0;  // the same of the couplings
};

/// At x [m] along u, by steps of `step`.
inline PotentialAlong potentialAlong(const solver::Potential& potential, std::span<const Vec3> x,
                                     std::span<const Vec3> u, double step)
{
    const auto gradientAt = [&](std::span<const Vec3> at, double& energy) {
        std::vector<Vec3> gradient(at.size(), Vec3::Zero());
        energy = potential.evaluate(at, gradient);
        return gradient;
    };
    PotentialAlong all;
    double plus = 0, minus = 0;
    all.gradient = gradientAt(x, all.energy);
    const std::vector<Vec3> after = gradientAt(sum(x, step, u), plus), before = gradientAt(sum(x, -step, u), minus);
    all.slope = solver::dot(all.gradient, u);
    all.slopeOfEnergy = (plus - minus) / (2 * step);
    potential.linearize(x, all.couplings);
    for (const solver::Coupling& c : all.couplings) {
        Vec3 v = Vec3::Zero();
        for (std::size_t a = 0; a < solver::Coupling::kNodes; ++a) v += double(c.weight[a]) * u[c.node[a]];
        all.tangent += v.dot(solver::multiply(c.Q, v));
    }
    all.tangentOfGradient = (solver::dot(after, u) - solver::dot(before, u)) / (2 * step);
    return all;
}

}  // namespace vdbfrac::test
