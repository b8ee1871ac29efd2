// Boundaries, loads and settings for tests that solve on a test::Block.
#pragma once

#include "block.h"

#include <vdbfrac/solver/backward_euler.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <random>
#include <span>
#include <vector>

namespace vdbfrac::test {

/// Solver tolerances so tight that what is left of an error is the discretisation's.
inline solver::NewtonSettings tightSettings()
{
    solver::NewtonSettings settings;
    settings.tolerance = 1e-11;
    settings.iterations = 100;
    settings.linearTolerance = 1e-9;
    settings.linearIterations = 50000;
    return settings;
}

/// No node held, no force.
inline solver::Boundary freeBoundary(std::size_t nodes)
{
    return {std::vector<std::uint8_t>(nodes, 0),
            std::vector<Vec3>(nodes, Vec3::Zero()),
            std::vector<Vec3>(nodes, Vec3::Zero()),
            {}};
}

/// Holds every node for which `held(lattice coordinates)` at its rest position.
template <class Held>
solver::Boundary clamped(const Block& block, const Held& held)
{
    solver::Boundary boundary = freeBoundary(block.nodes.size());
    for (std::size_t i = 0; i < block.nodes.size(); ++i) {
        boundary.fixed[i] = held(block.nodes[i]);
        boundary.target[i] = block.h * block.nodes[i].toVec();
    }
    return boundary;
}

/// Area that belongs to each node on the face of those nodes for which `on`: a third of each triangle. A uniform
/// traction times these is the load that does the same work.
template <class On>
std::vector<double> nodalAreas(const Block& block, const On& on)
{
    std::vector<double> area(block.nodes.size(), 0);
    for (const auto& e : block.elements) {
        const auto& tets = tetmesh::cellTets(e.shape);
        for (int t = 0; t < tets.count; ++t) {
            std::vector<std::uint32_t> face;
            for (int c : tets.corner[std::size_t(t)])
                if (on(block.nodes[e.node[std::size_t(c)]])) face.push_back(e.node[std::size_t(c)]);
            if (face.size() != 3) continue;
            const Vec3 a = block.nodes[face[0]].toVec(), b = block.nodes[face[1]].toVec(),
                       c = block.nodes[face[2]].toVec();
            for (std::uint32_t i : face) area[i] += block.h * block.h * (b - a).cross(c - a).norm() / 6;
        }
    }
    return area;
}

/// Mean over nodes of value(i), weighted.
template <class Value>
double weightedMean(const std::vector<double>& weight, const Value& value)
{
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < weight.size(); ++i)
        if (weight[i] > 0) sum += weight[i] * value(i), all += weight[i];
    return sum / all;
}

inline solver::State atRest(const Block& block)
{
    return {block.restPositions(), std::vector<Vec3>(block.nodes.size(), Vec3::Zero())};
}

inline Vec3 randomVec(std::mt19937& random, double size)
{
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return {x, y, z};
}

/// Shakes positions by `size` lattice spacings and velocities by `speed`.
inline solver::State shaken(const Block& block, double size, double speed, unsigned seed)
{
    solver::State state = atRest(block);
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
        state.x[i] += randomVec(random, size * block.h);
        state.v[i] = randomVec(random, speed);
    }
    return state;
}

/// sum of m v, and of m |v| (its scale).
struct Momentum {
    Vec3 linear = Vec3::Zero();
    double scale = 0;
};
inline Momentum momentum(const solver::ElasticOperator& elastic, std::span<const Vec3> v)
{
    Momentum p;
    for (std::size_t i = 0; i < v.size(); ++i) {
        p.linear += elastic.mass()[i] * v[i];
        p.scale += elastic.mass()[i] * v[i].norm();
    }
    return p;
}

inline double kineticEnergy(const solver::ElasticOperator& elastic, std::span<const Vec3> v)
{
    double energy = 0;
    for (std::size_t i = 0; i < v.size(); ++i) energy += 0.5 * elastic.mass()[i] * v[i].squaredNorm();
    return energy;
}

}  // namespace vdbfrac::test
