// Systems that are hard to solve: nearly incompressible, of very unlike parts, with hardly any material in a tet.
#include "cases.h"

#include <vdbfrac/lab/samples/cantilever.h>
#include <vdbfrac/solver/linear_solver.h>

#include <algorithm>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kStretch = 1.02;        // of all blocks here: the tangent is definite there
constexpr int kManyIterations = 100000;  // a stalled solve is counted, not cut short

struct Solution {
    std::vector<Vec3> u;
    int iterations = kManyIterations;
};

/// Static linear system of a block held at z = 0, solved by conjugate gradients with block-Jacobi.
Solution solve(const Block& block, const solver::ElasticOperator& elastic, const std::vector<Vec3>& force)
{
    constexpr double kTolerance = 1e-8;
    std::vector<Vec3> x = block.restPositions();
    for (Vec3& p : x) p *= kStretch;
    std::vector<std::uint8_t> fixed;
    for (Coord c : block.nodes) fixed.push_back(c.z == 0);
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    solver::LinearSolver linear(elastic, solver::LinearMethod::jacobi);
    Solution solution{std::vector<Vec3>(x.size(), Vec3::Zero())};
    const auto report = linear.solve({elastic, tangent, 0, fixed}, force, solution.u, {kTolerance, kManyIterations});
    if (report.status == solver::LinearStatus::converged) solution.iterations = report.iterations;
    return solution;
}

/// Pulls the nodes of the plane z = `top`, and a little sideways.
std::vector<Vec3> pull(const Block& block, int top)
{
    std::vector<Vec3> force;
    for (Coord c : block.nodes) force.push_back(c.z == top ? Vec3(.2, .1, 1) : Vec3::Zero());
    return force;
}

/// Iterations for a cube of 8^3 cells in which the cells for which `stiff` are 1e6 times as stiff.
template <class Stiff>
int iterationsWith(double nu, const Stiff& stiff)
{
    constexpr double kE = 1e5, kContrast = 1e6;
    const Block block({8, 8, 8}, .1);
    std::vector<tetmesh::CellElement> soft, hard;
    for (const auto& e : block.elements) (stiff(block.nodes[e.node[0]]) ? hard : soft).push_back(e);
    std::vector<solver::ElementSet> sets;
    if (!soft.empty()) sets.push_back({soft, block.nodes, 0, solver::makeMaterial(kE, nu, 1000)});
    if (!hard.empty()) sets.push_back({hard, block.nodes, 0, solver::makeMaterial(kContrast * kE, nu, 1000)});
    const solver::ElasticOperator elastic(sets, block.nodes.size(), block.h, solver::Volumetric::cell);
    return solve(block, elastic, pull(block, 8)).iterations;
}

}  // namespace

Measurements locking(Extent)
{
    constexpr double kFour = .85, kEight = .93;
    Measurements all;
    for (double nu : {.49, .499})
        for (auto [thick, limit] : {std::pair{4, kFour}, std::pair{8, kEight}})
            all.push_back(atLeast(at(nu) + "without mean_strain, tip deflection over Timoshenko's, " +
                                      std::to_string(thick) + " cells thick",
                                  deflectionRatio({tetmesh::Lattice::Kind::six, solver::Volumetric::cell, thick, nu}),
                                  limit));
    return all;
}

Measurements stiffnessContrast(Extent)
{
    constexpr double kMax = 10;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const double uniform = iterationsWith(nu, [](Coord) { return false; });
        const auto ratio = [&](const auto& stiff) { return iterationsWith(nu, stiff) / uniform; };
        all.push_back(atMost(at(nu) + "iterations over those of the uniform cube, upper half stiff",
                             ratio([](Coord c) { return c.z >= 4; }), kMax));
        all.push_back(atMost(at(nu) + "the same, eight stiff blocks",
                             ratio([](Coord c) { return c.x % 4 >= 2 && c.y % 4 >= 2 && c.z % 4 >= 2; }), kMax));
    }
    return all;
}

/// A cube of 6^3 whole cells with one more layer of cells on top, of which each tet has only a fraction of material.
Measurements tinyFractions(Extent)
{
    constexpr double kIterations = 1.2, kResult = .01;
    constexpr int kTop = 6;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const solver::Material material = solver::makeMaterial(1e5, nu, 1000);
        const Block bare({kTop, kTop, kTop}, .1);
        const Solution without = solve(bare, elasticOperator(bare, material), pull(bare, kTop));
        double most = 0, worst = 0, largest = 0;
        for (const Vec3& u : without.u) largest = std::max(largest, u.norm());
        for (double fraction : {1e-6, 1e-9, 1e-12, 1e-15, 1e-18}) {
            Block cut({kTop, kTop, kTop + 1}, .1);
            for (auto& e : cut.elements)
                for (double& f : e.fraction)
                    if (cut.nodes[e.node[0]].z == kTop) f = fraction * (f > 0);
            const Solution with = solve(cut, elasticOperator(cut, material), pull(cut, kTop));
            most = std::max(most, double(with.iterations) / without.iterations);
            for (std::size_t i = 0; i < without.u.size(); ++i)  // the nodes of the cube come first in both
                worst = std::max(worst, (with.u[i] - without.u[i]).norm() / largest);
        }
        all.push_back(atMost(at(nu) + "iterations over those without the cut cells", most, kIterations));
        all.push_back(atMost(at(nu) + "change of a displacement, of the largest", worst, kResult));
    }
    return all;
}

Measurements tetRemovedElsewhere(Extent)
{
    constexpr double kChange = 1e-14;
    Measurements all;
    for (double nu : kPoissonRatios) {
        Block block({6, 6, 6}, .1);
        const std::vector<Vec3> x = shaken(block, .2, 0, 7).x;
        const auto forces = [&] {
            std::vector<Vec3> f(x.size(), Vec3::Zero());
            elasticOperator(block, solver::makeMaterial(1e5, nu, 1000)).evaluate(x, f, nullptr);
            return f;
        };
        const std::vector<Vec3> before = forces();
        tetmesh::CellElement& changed = block.elements[100];
        changed.fraction[2] = 0;
        const std::vector<Vec3> after = forces();
        double largest = 0, worst = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            largest = std::max(largest, before[i].norm());
            if (std::find(changed.node.begin(), changed.node.end(), i) == changed.node.end())
                worst = std::max(worst, (after[i] - before[i]).norm());
        }
        all.push_back(atMost(at(nu) + "change of a force outside the cell, of the largest", worst / largest, kChange));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
