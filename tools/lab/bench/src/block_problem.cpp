#include "block_problem.h"

#include <vdbfrac/lab/samples/crack.h>

#include <cassert>

namespace vdbfrac::lab::bench {

namespace {

Block makeBlock(int n, Crack crack)
{
    Block block({n - 1, n - 1, n - 1}, 1. / (n - 1));
    if (crack == Crack::none) return block;
    assert(n % 4 == 1);
    const int middle = (n - 1) / 2;
    openCrack(block, {&Coord::y, crack == Crack::between ? middle + 1 : middle}, [=](Coord c) { return c.x < middle; });
    return block;
}

}  // namespace

BlockProblem::BlockProblem(int n, Crack crack)
    : mesh(makeBlock(n, crack)),
      elastic(elasticOperator(mesh, solver::makeMaterial(1e6, 0.3, 1000), solver::Volumetric::none))
{
    boundary.target.assign(mesh.nodes.size(), Vec3::Zero());
    boundary.force.assign(mesh.nodes.size(), Vec3::Zero());
    for (const Coord& c : mesh.nodes) {
        state.x.push_back(mesh.h * c.toVec());
        state.v.push_back(c.y == n - 1 ? Vec3(0, kBlockSpeed, 0) : Vec3::Zero());
        boundary.fixed.push_back(c.y == 0 || c.y == n - 1);
    }
}

void BlockProblem::moveTop(double distance)
{
    for (std::size_t i = 0; i < state.x.size(); ++i)
        if (boundary.fixed[i]) boundary.target[i] = state.x[i] + Vec3(0, mesh.nodes[i].y > 0 ? distance : 0, 0);
}

}  // namespace vdbfrac::lab::bench
