// Boundaries, loads and settings of solves on a Block, and what is measured of them.
#pragma once

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/backward_euler.h>

#include <cstddef>
#include <functional>
#include <random>
#include <span>
#include <vector>

namespace vdbfrac::lab {

/// Solver tolerances so tight that what is left of an error is the discretisation's.
solver::NewtonSettings tightSettings();

/// No node held, no force.
solver::Boundary freeBoundary(std::size_t nodes);

/// Holds every node for which `held(lattice coordinates)` at its rest position.
solver::Boundary clamped(const Block& block, const std::function<bool(Coord)>& held);

/// Area that belongs to each node on the face of those nodes for which `on`: a third of each triangle. A uniform
/// traction times these is the load that does the same work.
std::vector<double> nodalAreas(const Block& block, const std::function<bool(Coord)>& on);

/// Mean over nodes of value(i), weighted.
double weightedMean(const std::vector<double>& weight, const std::function<double(std::size_t)>& value);

solver::State atRest(const Block& block);

Vec3 randomVec(std::mt19937& random, double size);

/// Shakes positions by `size` lattice spacings and velocities by `speed`.
solver::State shaken(const Block& block, double size, double speed, unsigned seed);

/// sum of m v, and of m |v| (its scale).
struct Momentum {
    Vec3 linear = Vec3::Zero();
    double scale = 0;
};
Momentum momentum(const solver::ElasticOperator& elastic, std::span<const Vec3> v);

double kineticEnergy(const solver::ElasticOperator& elastic, std::span<const Vec3> v);

}  // namespace vdbfrac::lab
