#include <vdbfrac/lab/samples/block.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace vdbfrac::lab {

tetmesh::NodeField<float> sample(Coord lower, Coord upper, double dx, const std::function<double(Vec3)>& phi)
{
    const float band = float(3 * dx);
    const Coord grow{2, 2, 2};
    tetmesh::NodeField<float> field(lower - grow, upper + grow, band, -band);
    for (int z = lower.z - 2; z <= upper.z + 2; ++z)
        for (int y = lower.y - 2; y <= upper.y + 2; ++y)
            for (int x = lower.x - 2; x <= upper.x + 2; ++x) {
                const float value = std::clamp(float(phi(dx * Coord{x, y, z}.toVec())), -band, band);
                if (value < band) field.set({x, y, z}, value);
            }
    return field;
}

namespace {

/// `cells` of the block; `patch`: which 8^3 of them.
tetmesh::CellElement wholeCell(Coord cells, Coord patch, Coord cell, const tetmesh::Lattice& lattice)
{
    tetmesh::CellElement e;
    e.shape = lattice.shapeOf(cell);
    e.patch = std::uint32_t((patch.z * 1024 + patch.y) * 1024 + patch.x);
    for (int t = 0; t < tetmesh::cellTets(e.shape).count; ++t) e.fraction[std::size_t(t)] = 1;
    for (int k = 0; k < tetmesh::kCorners; ++k) {
        const Coord c = cell + tetmesh::cornerOffset(k);
        e.node[std::size_t(k)] = std::uint32_t((c.z * (cells.y + 1) + c.y) * (cells.x + 1) + c.x);
    }
    return e;
}

}  // namespace

Block::Block(Coord cells, double spacing, tetmesh::Lattice::Kind kind) : h(spacing)
{
    std::vector<std::pair<Coord, Coord>> order;  // patch, cell
    for (int z = 0; z <= cells.z; ++z)
        for (int y = 0; y <= cells.y; ++y)
            for (int x = 0; x <= cells.x; ++x) {
                nodes.push_back({x, y, z});
                if (x < cells.x && y < cells.y && z < cells.z) order.push_back({{x >> 3, y >> 3, z >> 3}, {x, y, z}});
            }
    std::sort(order.begin(), order.end());
    const tetmesh::Lattice lattice{kind, 1, spacing};
    elements.reserve(order.size());
    for (const auto& [patch, cell] : order) elements.push_back(wholeCell(cells, patch, cell, lattice));
}

std::vector<Vec3> Block::restPositions() const
{
    std::vector<Vec3> X;
    for (Coord c : nodes) X.push_back(h * c.toVec());
    return X;
}

std::vector<Vec3> Block::bentPositions() const
{
    std::vector<Vec3> x = restPositions();
    for (Vec3& p : x) {
        const double angle = 0.5 * p.y();
        const Vec3 turned = {std::cos(angle) * p.x() - std::sin(angle) * p.z(), 1.2 * p.y(),
                             std::sin(angle) * p.x() + std::cos(angle) * p.z()};
        p = turned + 0.05 * Vec3(std::sin(3 * p.z()), std::cos(2 * p.x()), std::sin(4 * p.y()));
    }
    return x;
}

Block asBlock(const tetmesh::CutMesh& mesh)
{
    Block block({1, 1, 1}, mesh.lattice().spacing());
    block.elements = mesh.elements();
    block.nodes = mesh.nodes();
    return block;
}

solver::ElasticOperator elasticOperator(const Block& block, const solver::Material& material,
                                        solver::Elasticity elasticity)
{
    const solver::ElementSet set{block.elements, block.nodes, 0, material};
    return solver::ElasticOperator(std::span(&set, 1), block.nodes.size(), block.h, elasticity);
}

solver::ElasticOperator elasticOperator(const tetmesh::CutMesh& mesh, const solver::Material& material,
                                        solver::Elasticity elasticity)
{
    const solver::ElementSet set{mesh.elements(), mesh.nodes(), 0, material};
    return solver::ElasticOperator(std::span(&set, 1), mesh.nodeCount(), mesh.lattice().spacing(), elasticity);
}

std::vector<Mat3> diagonalBlocks(const solver::ElasticOperator& elastic, const solver::Tangent& tangent)
{
    const auto sums = elastic.diagonal(tangent);
    std::vector<Mat3> blocks(elastic.nodeCount());
    for (std::size_t n = 0; n < blocks.size(); ++n) {
        const solver::ElasticOperator::PackedBlock k = sums(n);
        blocks[n] << k[0], k[5], k[4], k[5], k[1], k[3], k[4], k[3], k[2];
    }
    return blocks;
}

}  // namespace vdbfrac::lab
