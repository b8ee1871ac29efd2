#include "step_control.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::core {

namespace {

using CornerValues = std::array<Vec3, tetmesh::kCorners>;

double largestDifference2(const CornerValues& v)
{
    double most = 0;
    for (std::size_t a = 1; a < v.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) most = std::max(most, (v[a] - v[b]).squaredNorm());
    return most;
}

/// Fastest that a node of a cell moves away from another [m/s].
double fastestSpread(std::span<const Body> bodies, std::span<const Vec3> velocity)
{
    double fastest = 0;
    for (const Body& body : bodies) {
        const auto& elements = body.mesh->elements();
        fastest = orderedMax(elements.size(), kChunk, fastest, [&](std::size_t begin, std::size_t end) {
            double most = 0;
            for (std::size_t e = begin; e < end; ++e) {
                CornerValues v;
                for (std::size_t c = 0; c < v.size(); ++c) v[c] = velocity[body.firstNode + elements[e].node[c]];
                double fromFirst = 0;
                for (const Vec3& other : v) fromFirst = std::max(fromFirst, (other - v[0]).squaredNorm());
                // Two are no farther apart than twice that.
                if (4 * fromFirst > most) most = std::max(most, largestDifference2(v));
            }
            return most;
        });
    }
    return std::sqrt(fastest);
}

}  // namespace

double StepControl::limit(double spread, const StepOutlook& outlook) const
{
    double limit = 1 / settings_.fps;
    if (settings_.substeps > 0) return limit / settings_.substeps;
    if (spread > 0) limit = std::min(limit, settings_.nodeCfl * h_ / spread);
    for (StepLimit* l : outlook.stages.limits) limit = std::min(limit, l->largestStep(outlook.state, outlook.time));
    limit = std::min(limit, outlook.integrator.largestStep(outlook.stages.solve, outlook.state.x));
    return limit;
}

StepControl::Choice StepControl::next(double left, const StepOutlook& outlook) const
{
    constexpr double kWhole = 1e-6;  // a quotient this near to a whole number is one: times are sums of very many steps
    constexpr int kMaxCutbacks = 8;
    // Cells that nodes of one may fly apart: beyond, Newton's method has nothing to start from.
    constexpr double kHopeless = 4;
    Choice choice;
    const double spread = fastestSpread(outlook.bodies, outlook.state.v);
    double longest = limit(spread, outlook);
    if (settings_.substeps > 0)
        for (StepLimit* l : outlook.stages.limits) {
            const double largest = l->cutsBack() ? l->largestStep(outlook.state, outlook.time) : longest;
            for (; longest > largest && choice.halvings < kMaxCutbacks; ++choice.halvings) longest *= 0.5;
        }
    // An explicit scheme that flies apart shall do so at once.
    for (; !outlook.integrator.isExplicit() && longest * spread > kHopeless * h_ && choice.halvings < kMaxCutbacks;
         ++choice.halvings)
        longest *= 0.5;
    // Not of what is left of a frame: where nothing converges, that would shrink with each step and never end.
    choice.shortest = (0.5 + kWhole) * longest / std::exp2(kMaxCutbacks);
    choice.dt = left / std::max(1., std::ceil(left / std::min(longest, trusted_) - kWhole));
    return choice;
}

}  // namespace vdbfrac::core
