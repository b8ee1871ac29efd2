// A cut ball of which some has flowed, and some yields, for tests of the kernels.
#pragma once

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/solver/element.h>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace vdbfrac::lab {

inline const solver::Material kBallGel = solver::makeMaterial(1e5, .3, 1000);

inline Mat3 randomFlow(std::mt19937& random, double size)
{
    Mat3 flow = Mat3::Identity();
    for (int d = 0; d < 3; ++d) flow.col(d) += randomVec(random, size);
    return flow / std::cbrt(flow.determinant());
}

enum class Shape { six, five, tets };

/// A cut ball; of its tets every third has flowed in every second group of a hundred elements.
struct Body {
    lab::Block block;
    std::vector<tetmesh::TetGradients> gradients;
    tetmesh::TetField<Mat3> flow;
    std::vector<float> stiffness;
    solver::Yield yield;

    explicit Body(Shape shape)
        : block(lab::asBlock(lab::cutBall(
              {shape == Shape::five ? tetmesh::Lattice::Kind::five : tetmesh::Lattice::Kind::six, 1, .1}, 4.3)))
    {
        if (shape == Shape::tets) makeLoose();
        flow = tetmesh::TetField<Mat3>(block.elements.size(), Mat3::Identity());
        std::mt19937 random(3);
        for (std::size_t e = 0; e < block.elements.size(); ++e)
            for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t) {
                if (e / 100 % 2 == 0 && (e + t) % 3 == 0) flow(e, t) = randomFlow(random, .2);
                stiffness.push_back(float(1 + (e + t) % 4) / 4);
            }
    }
    solver::ElementSet set() const { return {block.elements, block.nodes, 0, kBallGel, gradients, &flow, stiffness}; }
    /// With a yield at a strain of .01 to .05, but in every fifth element none, and a share of .7.
    solver::ElementSet yieldingSet()
    {
        yield.strain.clear(), yield.share = .7;
        for (std::size_t e = 0; e < block.elements.size(); ++e)
            yield.strain.push_back(e % 5 == 4 ? kInfinity : .01 * double(1 + e % 5));
        solver::ElementSet all = set();
        all.yield = &yield;
        return all;
    }
    solver::ElasticOperator elastic(solver::Elasticity elasticity) const { return elastic(set(), elasticity); }
    solver::ElasticOperator elastic(const solver::ElementSet& set, solver::Elasticity elasticity) const
    {
        return {std::span(&set, 1), block.nodes.size(), block.h, elasticity};
    }
    solver::ElementOf element(std::size_t e) const
    {
        return {block.elements[e], gradients.empty() ? nullptr : &gradients[e], block.h, &flow(e, 0),
                &stiffness[tetmesh::tetEntry(e, 0)]};
    }
    std::vector<Vec3> random(double size, unsigned seed) const
    {
        std::mt19937 random(seed);
        std::vector<Vec3> u;
        for (std::size_t i = 0; i < block.nodes.size(); ++i) u.push_back(randomVec(random, size));
        return u;
    }
    std::vector<Vec3> shaken(double size) const
    {
        std::vector<Vec3> x = random(size * block.h, 7);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] += block.h * block.nodes[i].toVec();
        return x;
    }

private:
    void makeLoose()
    {
        std::vector<tetmesh::CellElement> tets;
        for (const tetmesh::CellElement& cell : block.elements) {
            const tetmesh::CellTets& of = tetmesh::cellTets(cell.shape);
            for (std::size_t t = 0; t < std::size_t(of.count); ++t) {
                if (cell.fraction[t] == 0) continue;
                tetmesh::CellElement tet;
                tet.node.fill(cell.node[std::size_t(of.corner[t][0])]);
                for (std::size_t a = 0; a < 4; ++a) tet.node[a] = cell.node[std::size_t(of.corner[t][a])];
                tet.fraction[0] = of.volume[t] * cell.fraction[t];
                tet.shape = tetmesh::CellShape::tet;
                tet.patch = std::uint32_t(tets.size()) / 1000;
                gradients.push_back({of.gradient[t][1], of.gradient[t][2], of.gradient[t][3]});
                tets.push_back(tet);
            }
        }
        block.elements = tets;
    }
};

/// Of the gradient along u against differences of the energy over 2 `step` [m], over the norms of both.
inline double errorOfGradient(const solver::ElasticOperator& elastic, const std::vector<Vec3>& x,
                              const std::vector<Vec3>& u, double step)
{
    std::vector<Vec3> plus = x, minus = x, g(x.size(), Vec3::Zero());
    for (std::size_t i = 0; i < x.size(); ++i) plus[i] += step * u[i], minus[i] -= step * u[i];
    elastic.evaluate(x, g, nullptr);
    const double slope = (elastic.evaluate(plus, {}, nullptr) - elastic.evaluate(minus, {}, nullptr)) / (2 * step);
    return std::abs(slope - solver::dot(g, u)) / std::sqrt(solver::dot(g, g) * solver::dot(u, u));
}

/// Of the product of the tangent with u against differences of the gradient over 2 `step` [m], over its norm.
inline double errorOfProduct(const solver::ElasticOperator& elastic, const std::vector<Vec3>& x,
                             const std::vector<Vec3>& u, double step)
{
    std::vector<Vec3> plus = x, minus = x, up(x.size(), Vec3::Zero()), down = up, Ku = up;
    for (std::size_t i = 0; i < x.size(); ++i) plus[i] += step * u[i], minus[i] -= step * u[i];
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    elastic.evaluate(plus, up, nullptr), elastic.evaluate(minus, down, nullptr);
    elastic.addProduct(tangent, u, Ku);
    double error = 0;
    for (std::size_t i = 0; i < x.size(); ++i) error += (Ku[i] - (up[i] - down[i]) / (2 * step)).squaredNorm();
    return std::sqrt(error / solver::dot(Ku, Ku));
}

/// Diagonal blocks and matrices of elements are those of the product: of the tangents of the tets, and of their means
/// over cells.
inline void expectPartsOfTheProduct(const solver::ElasticOperator& elastic, const Body& body)
{
    constexpr double kStored = 1e-6;  // single precision
    const auto u = body.random(1, 3);
    solver::Tangent tangent, cells;
    elastic.evaluate(body.shaken(0.1), {}, &tangent, 0.3);
    elastic.averageTets(tangent, cells);
    for (const auto* kept : {&tangent, &cells}) {
        const auto blocks = diagonalBlocks(elastic, *kept);
        std::vector<Vec3> Ku(u.size(), Vec3::Zero()), summed = Ku;
        std::vector<Mat3> diagonal(u.size(), Mat3::Zero());
        elastic.addProduct(*kept, u, Ku);
        for (std::size_t e = 0; e < body.block.elements.size(); ++e) {
            const tetmesh::CellElement& element = body.block.elements[e];
            const auto K = elastic.elementMatrix(*kept, e);
            const int corners = element.shape == tetmesh::CellShape::tet ? 4 : tetmesh::kCorners;
            for (int i = 0; i < corners; ++i) {
                diagonal[element.node[std::size_t(i)]] += K.block<3, 3>(3 * i, 3 * i);
                for (int j = 0; j < corners; ++j)
                    summed[element.node[std::size_t(i)]] +=
                        K.block<3, 3>(3 * i, 3 * j) * u[element.node[std::size_t(j)]];
            }
        }
        double scale = 0;
        for (const Mat3& block : diagonal) scale = std::max(scale, block.norm());
        for (std::size_t i = 0; i < u.size(); ++i) {
            EXPECT_LT((blocks[i] - diagonal[i]).norm(), kStored * scale);
            EXPECT_LT((Ku[i] - summed[i]).norm(), kStored * scale);
        }
    }
}

}  // namespace vdbfrac::lab
