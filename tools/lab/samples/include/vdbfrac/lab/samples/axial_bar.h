// A bar that vibrates along its axis, with a period that is known.
#pragma once

#include <vdbfrac/lab/samples/loads.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace vdbfrac::lab {

/// A bar of 16 cells fixed at x = 0, released from the shape of its first axial mode; nu = 0.
struct AxialBar {
    static constexpr double kE = 1, kRho = 1, kLength = 1, kStretch = 1e-3;
    static constexpr int kCells = 16;
    Block block{{kCells, 2, 2}, kLength / kCells};
    solver::ElasticOperator elastic = elasticOperator(block, solver::makeMaterial(kE, 0, kRho));
    solver::Boundary boundary = clamped(block, [](Coord c) { return c.x == 0; });
    std::vector<double> endArea = nodalAreas(block, [](Coord c) { return c.x == kCells; });
    solver::State state = atRest(block);
    double period = 4 * kLength * std::sqrt(kRho / kE);

    AxialBar()
    {
        for (Vec3& x : state.x) x.x() += kStretch * std::sin(std::numbers::pi * x.x() / (2 * kLength));
    }
    double tip() const
    {
        return weightedMean(endArea, [&](std::size_t i) { return state.x[i].x() - kLength; });
    }
};

}  // namespace vdbfrac::lab
