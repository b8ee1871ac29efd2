// The functions behind the rows, by what they need.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/lab/verify/hard_case.h>

namespace vdbfrac::core {
class Simulation;
}

namespace vdbfrac::lab::verify {

using Measurements = std::vector<Measurement>;

inline constexpr double kPoissonRatios[] = {.3, .49};  ///< where nu matters

inline Measurement atMost(std::string what, double value, double limit)
{
    return {std::move(what), value, Bound::atMost, limit};
}
inline Measurement atLeast(std::string what, double value, double limit)
{
    return {std::move(what), value, Bound::atLeast, limit};
}
/// "nu = 0.3: " before what is measured.
std::string at(double nu);
/// How many of them are not finite.
double countNotFinite(std::span<const Vec3> values);
/// Positions and velocities of nodes that are not finite.
double notFiniteNodes(const core::Simulation& simulation);
/// m^3, of all fragments together, at rest.
double fragmentVolume(const core::Simulation& simulation);

// starts.cpp
Measurements mirroredStart(Extent);
Measurements scrambledStart(Extent);
Measurements collapsedStart(Extent);
Measurements stretchAndSquash(Extent);
// stiffness.cpp
Measurements locking(Extent);
Measurements stiffnessContrast(Extent);
Measurements tinyFractions(Extent);
Measurements tetRemovedElsewhere(Extent);
// shapes.cpp
Measurements phiZeroAtNodes(Extent);
Measurements thinSheet(Extent);
Measurements singleTets(Extent);
Measurements resolutions(Extent);
// motion.cpp
Measurements detachedDynamic(Extent);
Measurements detachedStatic(Extent);
Measurements longSteps(Extent);
Measurements unitsOfAnySize(Extent);
Measurements manySteps(Extent);
// scenes.cpp
Measurements badNumbers(Extent);
Measurements thousandfoldSpeed(Extent);
Measurements foam(Extent);
Measurements unbreakable(Extent);
Measurements notFinite(Extent);
// tangles.cpp
Measurements tangledContact(Extent);
// torture.cpp
Measurements jerkedGrips(Extent);
Measurements resistanceGone(Extent);
Measurements coarseLattices(Extent);
Measurements thinWalls(Extent);
// torture_motion.cpp
Measurements planeThroughNodes(Extent);
Measurements spunApart(Extent);
Measurements touchingWhileTorn(Extent);

}  // namespace vdbfrac::lab::verify
