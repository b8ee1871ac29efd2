// Solids made straight as phi on voxel nodes, for tests that need no OpenVDB.
#pragma once

#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

namespace vdbfrac::test {

/// phi sampled on [lower, upper] grown by two layers, capped at +-3 dx.
inline tetmesh::NodeField<float> sample(Coord lower, Coord upper, double dx, const std::function<double(Vec3)>& phi)
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

/// A block of whole cells with a corner at the origin, without any level set (whose zero contour would round off the
/// edges): elements as CutMesh makes them deep inside the material.
struct Block {
    std::vector<tetmesh::CellElement> elements;
    std::vector<Coord> nodes;
    double h = 1;

    Block(Coord cells, double spacing, tetmesh::Lattice::Kind kind = tetmesh::Lattice::Kind::six) : h(spacing)
    {
        const auto node = [&](int x, int y, int z) {
            return std::uint32_t((z * (cells.y + 1) + y) * (cells.x + 1) + x);
        };
        for (int z = 0; z <= cells.z; ++z)
            for (int y = 0; y <= cells.y; ++y)
                for (int x = 0; x <= cells.x; ++x) nodes.push_back({x, y, z});
        std::vector<std::pair<Coord, Coord>> order;  // 8^3 block, cell
        for (int z = 0; z < cells.z; ++z)
            for (int y = 0; y < cells.y; ++y)
                for (int x = 0; x < cells.x; ++x) order.push_back({{x >> 3, y >> 3, z >> 3}, {x, y, z}});
        std::sort(order.begin(), order.end());
        const tetmesh::Lattice lattice{kind, 1, spacing};
        for (const auto& [patch, c] : order) {
            tetmesh::CellElement e;
            e.shape = lattice.shapeOf(c);
            e.patch = std::uint32_t((patch.z * 1024 + patch.y) * 1024 + patch.x);
            for (int t = 0; t < tetmesh::cellTets(e.shape).count; ++t) e.fraction[std::size_t(t)] = 1;
            for (int k = 0; k < tetmesh::kCorners; ++k)
                e.node[std::size_t(k)] = node(c.x + (k & 1), c.y + (k >> 1 & 1), c.z + (k >> 2 & 1));
            elements.push_back(e);
        }
    }

    std::vector<Vec3> restPositions() const
    {
        std::vector<Vec3> X;
        for (Coord c : nodes) X.push_back(h * c.toVec());
        return X;
    }
};

inline solver::ElasticOperator elasticOperator(const Block& block, const solver::Material& material,
                                               solver::Elasticity elasticity = solver::Volumetric::cell)
{
    const solver::ElementSet set{block.elements, block.nodes, 0, material};
    return solver::ElasticOperator(std::span(&set, 1), block.nodes.size(), block.h, elasticity);
}

inline solver::ElasticOperator elasticOperator(const tetmesh::CutMesh& mesh, const solver::Material& material,
                                               solver::Elasticity elasticity = solver::Volumetric::cell)
{
    const solver::ElementSet set{mesh.elements(), mesh.nodes(), 0, material};
    return solver::ElasticOperator(std::span(&set, 1), mesh.nodeCount(), mesh.lattice().spacing(), elasticity);
}

inline std::vector<Mat3> diagonalBlocks(const solver::ElasticOperator& elastic, const solver::Tangent& tangent)
{
    const auto sums = elastic.diagonal(tangent);
    std::vector<Mat3> blocks(elastic.nodeCount());
    for (std::size_t n = 0; n < blocks.size(); ++n) {
        const solver::ElasticOperator::PackedBlock k = sums(n);
        blocks[n] << k[0], k[5], k[4], k[5], k[1], k[3], k[4], k[3], k[2];
    }
    return blocks;
}

}  // namespace vdbfrac::test
