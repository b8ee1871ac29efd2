#include "cases.h"

#include <vdbfrac/core/simulation.h>

#include <algorithm>
#include <cstdio>

namespace vdbfrac::lab::verify {

std::string at(double nu)
{
    char text[32];
    std::snprintf(text, sizeof text, "nu = %g: ", nu);
    return text;
}

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
