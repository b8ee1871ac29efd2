#include <vdbfrac/solver/potential.h>

#include "node_loops.h"

namespace vdbfrac::solver {

EnergyFlow storedFlow(const Potential& potential, const Leg& leg)
{
    std::vector<Vec3> gradient(leg.at.size(), Vec3::Zero()), unused(leg.at.size(), Vec3::Zero());
    (void)potential.evaluate(leg.at, gradient);
    const double work = potential.evaluate(leg.from, unused) - potential.evaluate(leg.to, unused);
    const double held =
        nodeSum<double>(gradient.size(), [&](std::size_t i) { return gradient[i].dot(leg.to[i] - leg.from[i]); });
    return {work, 0, work + held};
}

}  // namespace vdbfrac::solver
