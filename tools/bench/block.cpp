#include "block.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>
#include <utility>

namespace vdbfrac::tools::bench {

namespace {

tetmesh::CellElement wholeCell(int n, const Coord& block, const Coord& cell)
{
    tetmesh::CellElement e;
    e.patch = std::uint32_t((block.z * 1024 + block.y) * 1024 + block.x);
    e.fraction.fill(1);
    for (int k = 0; k < tetmesh::kCorners; ++k) {
        const Coord c = cell + tetmesh::cornerOffset(k);
        e.node[std::size_t(k)] = std::uint32_t((c.z * n + c.y) * n + c.x);
    }
    return e;
}

/// Gives the cells above the plane of the crack nodes of their own on the torn half of it.
void tear(BlockMesh& mesh, int n, Crack crack)
{
    assert(n % 4 == 1);
    const int middle = (n - 1) / 2, plane = crack == Crack::between ? middle + 1 : middle;
    const std::size_t uncracked = mesh.nodes.size();
    std::vector<std::uint32_t> copy(uncracked);
    for (std::size_t i = 0; i < uncracked; ++i) {
        copy[i] = std::uint32_t(i);
        const Coord c = mesh.nodes[i];
        if (c.y != plane || c.x >= middle) continue;
        copy[i] = std::uint32_t(mesh.nodes.size());
        mesh.nodes.push_back(c);
    }
    for (tetmesh::CellElement& e : mesh.elements)
        if (mesh.nodes[e.node[0]].y == plane)
            for (std::uint32_t& node : e.node) node = copy[node];
}

solver::ElasticOperator makeElastic(const BlockMesh& mesh)
{
    const solver::ElementSet set{mesh.elements, mesh.nodes, 0, solver::makeMaterial(1e6, 0.3, 1000)};
    return solver::ElasticOperator(std::span(&set, 1), mesh.nodes.size(), mesh.h, solver::Volumetric::none);
}

}  // namespace

BlockMesh::BlockMesh(int n, Crack crack) : h(1. / (n - 1))
{
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) nodes.push_back({x, y, z});
    std::vector<std::pair<Coord, Coord>> order;  // block, cell
    for (const Coord& c : nodes)
        if (c.x < n - 1 && c.y < n - 1 && c.z < n - 1) order.push_back({{c.x >> 3, c.y >> 3, c.z >> 3}, c});
    std::sort(order.begin(), order.end());
    elements.reserve(order.size());
    for (const auto& [block, cell] : order) elements.push_back(wholeCell(n, block, cell));
    if (crack != Crack::none) tear(*this, n, crack);
}

BlockProblem::BlockProblem(int n, Crack crack) : mesh(n, crack), elastic(makeElastic(mesh))
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

std::vector<Vec3> BlockProblem::bent() const
{
    std::vector<Vec3> x;
    x.reserve(mesh.nodes.size());
    for (const Coord& c : mesh.nodes) {
        const Vec3 p = mesh.h * c.toVec();
        const double angle = 0.5 * p.y();
        const Vec3 turned = {std::cos(angle) * p.x() - std::sin(angle) * p.z(), 1.2 * p.y(),
                             std::sin(angle) * p.x() + std::cos(angle) * p.z()};
        x.push_back(turned + 0.05 * Vec3(std::sin(3 * p.z()), std::cos(2 * p.x()), std::sin(4 * p.y())));
    }
    return x;
}

}  // namespace vdbfrac::tools::bench
