// What every mesh of tets has to be.
#pragma once

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/tetmesh/tet_mesh.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace vdbfrac::test {

/// Tets of positive volume without stray points; a boundary that is the faces of one tet, closed, outward, each edge of
/// it in two triangles.
inline void expectSound(const tetmesh::TetMesh& mesh)
{
    ASSERT_FALSE(mesh.tets.empty());
    std::vector<bool> used(mesh.points.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
        for (std::uint32_t v : mesh.tets[t]) {
            ASSERT_LT(v, mesh.points.size());
            used[v] = true;
        }
        ASSERT_GT(tetVolume(mesh, t), 0) << t;
    }
    EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "stray points";
    EXPECT_EQ(mesh.boundary, tetmesh::boundaryOf(mesh.tets));
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double enclosed = 0;
    for (const auto& f : mesh.boundary) {
        for (std::size_t k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
        enclosed += mesh.points[f[0]].dot(mesh.points[f[1]].cross(mesh.points[f[2]])) / 6;
    }
    std::size_t bad = 0;
    for (const auto& [edge, n] : edges) bad += n != 1 || !edges.contains({edge.second, edge.first});
    EXPECT_EQ(bad, 0u) << "edges of the boundary without exactly two triangles";
    constexpr double kRounding = 1e-10;  // of sums of up to 1e6 terms
    EXPECT_NEAR(enclosed, volumeOf(mesh), kRounding * volumeOf(mesh));
}

/// Parts that hang together by points.
template <class Cells>
std::size_t connectedParts(const Cells& cells, std::size_t points)
{
    DisjointSets sets(points);
    for (const auto& cell : cells)
        for (std::uint32_t v : cell) sets.join(cell[0], v);
    std::set<std::uint32_t> names;
    for (const auto& cell : cells) names.insert(sets.find(cell[0]));
    return names.size();
}
inline std::size_t componentsOf(const tetmesh::TetMesh& mesh) { return connectedParts(mesh.tets, mesh.points.size()); }
inline std::size_t boundaryComponentsOf(const tetmesh::TetMesh& mesh)
{
    return connectedParts(mesh.boundary, mesh.points.size());
}

/// The smallest dihedral angle of all tets [degrees], between the heights of their faces over each edge.
inline double smallestDihedral(const tetmesh::TetMesh& mesh)
{
    double smallest = 180;
    for (const auto& t : mesh.tets)
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = i + 1; j < 4; ++j) {
                std::size_t k = 0;
                while (k == i || k == j) ++k;
                const std::size_t l = 6 - i - j - k;
                const Vec3 edge = (mesh.points[t[j]] - mesh.points[t[i]]).normalized();
                const auto height = [&](std::size_t c) {
                    const Vec3 d = mesh.points[t[c]] - mesh.points[t[i]];
                    return Vec3(d - edge * edge.dot(d));
                };
                const Vec3 a = height(k), b = height(l);
                smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi);
            }
    return smallest;
}

}  // namespace vdbfrac::test
