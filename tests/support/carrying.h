// What goes along when a mesh is cut again: values of tets, and points.
#pragma once

#include "mesh_checks.h"

#include <vdbfrac/tetmesh/embedded_mesh.h>
#include <vdbfrac/tetmesh/tet_field.h>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <vector>

namespace vdbfrac::test {

using Nodes = std::array<std::uint32_t, 4>;

template <class F>
void eachTet(const tetmesh::BodyMesh& mesh, const F& f)
{
    for (std::size_t e = 0; e < mesh.elements().size(); ++e) {
        const tetmesh::CellElement& element = mesh.elements()[e];
        const auto& tets = tetmesh::cellTets(element.shape);
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            if (element.fraction[t] == 0) continue;
            Nodes node;
            for (std::size_t a = 0; a < 4; ++a) node[a] = element.node[std::size_t(tets.corner[t][a])];
            f(e, t, node);
        }
    }
}

/// Each tet with its own nodes for a value.
inline tetmesh::TetField<Nodes> ownNodes(const tetmesh::BodyMesh& mesh)
{
    tetmesh::TetField<Nodes> field(mesh.elements().size());
    eachTet(mesh, [&](std::size_t e, std::size_t t, const Nodes& node) { field(e, t) = node; });
    return field;
}

/// Cuts `mesh` 60 times at random places within `reach` voxels and follows values of tets and points through it. A
/// value is the nodes of its tet some cuts ago: those that the nodes of the tet now were then.
inline void expectCarried(tetmesh::BodyMesh& mesh, int reach)
{
    constexpr double kRounding = 1e-12;  // m
    const double dx = mesh.voxelSize();
    std::mt19937 random(21);
    std::uniform_real_distribution<double> place(-0.8 * reach * dx, 0.8 * reach * dx), size(.05, .35);
    std::vector<Vec3> X;
    for (int i = 0; i < 300; ++i) X.push_back({place(random), place(random), place(random)});
    tetmesh::EmbeddedMesh points(mesh, X);
    EXPECT_LT(points.lost(), X.size());
    tetmesh::TetField<Nodes> field = ownNodes(mesh);
    std::vector<std::uint32_t> origin;
    const auto start = [&] {
        field = ownNodes(mesh);
        origin.resize(mesh.nodeCount());
        for (std::uint32_t i = 0; i < origin.size(); ++i) origin[i] = i;
    };
    start();
    std::int64_t recut = 0;
    for (int round = 0; round < 60; ++round) {
        if (round % 15 == 0) start();  // now with parts that are apart
        const Coord corner{reach + 2, reach + 2, reach + 2};
        const Vec3 center(place(random), place(random), place(random));
        const auto update = mesh.update(raised(mesh, -1 * corner, corner, hollow(ballAt(center, size(random)))));
        recut += std::int64_t(update.previousElement.recut.size());
        field.carry(mesh, update.previousElement);
        points.carry(mesh, update);
        std::vector<std::uint32_t> now;
        for (std::uint32_t old : update.previousNode) now.push_back(origin[old]);
        origin = std::move(now);
        ASSERT_EQ(field.elements(), mesh.elements().size());
        eachTet(mesh, [&](std::size_t e, std::size_t t, const Nodes& node) {
            for (std::size_t a = 0; a < 4; ++a) ASSERT_EQ(field(e, t)[a], origin[node[a]]) << round;
        });
        const tetmesh::EmbeddedMesh again(mesh, X, points.places());
        const std::vector<Vec3> rest = tetmesh::restPositions(mesh);
        std::vector<Vec3> at(X.size(), Vec3::Constant(7));
        points.deform(rest, at);
        for (std::size_t i = 0; i < X.size(); ++i) {
            if (points.isLost(i))
                EXPECT_EQ(at[i], Vec3::Constant(7)) << round;
            else
                EXPECT_LT((at[i] - X[i]).norm() + (again[i].at(rest) - X[i]).norm(), kRounding) << round;
        }
        if (testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(recut, 100);
    EXPECT_GT(points.lost(), 0u);
}

/// What an update says it kept and replaced is all there is, once.
inline void expectComplete(const tetmesh::PreviousElements& p, std::size_t oldElements, std::size_t newElements)
{
    std::vector<int> old(oldElements), now(newElements);
    for (const auto& kept : p.kept)
        for (std::uint32_t i = 0; i < kept.count; ++i) ++old.at(kept.old + i), ++now.at(kept.first + i);
    for (const auto& r : p.replaced) ++old.at(r.old);
    for (const auto& r : p.recut) ++now.at(r.element);
    for (int times : old) ASSERT_EQ(times, 1);
    for (int times : now) ASSERT_EQ(times, 1);
}

}  // namespace vdbfrac::test
