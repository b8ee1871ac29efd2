#include "cases.h"

#include <vdbfrac/core/simulation.h>

#include <fmt/format.h>

#include <algorithm>

namespace vdbfrac::lab::verify {

std::string at(double nu) { return fmt::format("nu = {:g}: ", nu); }

double countNotFinite(std::span<const Vec3> values)
{
    return double(std::count_if(values.begin(), values.end(), [](const Vec3& v) { return !v.allFinite(); }));
}

double notFiniteNodes(const core::Simulation& simulation)
{
    return countNotFinite(simulation.x()) + countNotFinite(simulation.v());
}

double fragmentVolume(const core::Simulation& simulation)
{
    double sum = 0;
    for (const core::Body& body : simulation.bodies())
        for (const auto& f : body.fragments.fragments()) sum += f.restVolume;
    return sum;
}

}  // namespace vdbfrac::lab::verify
