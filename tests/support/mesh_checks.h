// Solids, updates and comparisons for tests of the cut mesh.
#pragma once

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/tetmesh/cut_mesh_surface.h>
#include <vdbfrac/tetmesh/fragments.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>
#include <vector>

namespace vdbfrac::test {

using Phi = std::function<double(const Vec3&)>;

inline Phi ballAt(Vec3 center, double r)
{
    return [=](Vec3 p) { return (p - center).norm() - r; };
}
inline Phi boxAt(Vec3 center, Vec3 half)
{
    return [=](Vec3 p) {
        const Vec3 q = (p - center).cwiseAbs() - half;
        return q.cwiseMax(0.).norm() + std::min(0., q.maxCoeff());
    };
}
inline Phi torus(double ring, double tube)
{
    return [=](Vec3 p) { return std::hypot(p.head<2>().norm() - ring, p.z()) - tube; };
}

inline void expectSame(const tetmesh::CutMesh& a, const tetmesh::CutMesh& b)
{
    ASSERT_EQ(a.nodes(), b.nodes());
    ASSERT_EQ(a.elements().size(), b.elements().size());
    for (std::size_t e = 0; e < a.elements().size(); ++e) {
        const tetmesh::CellElement &p = a.elements()[e], &q = b.elements()[e];
        ASSERT_EQ(p.node, q.node) << e;
        ASSERT_EQ(p.fraction, q.fraction) << e;
        ASSERT_EQ(p.shape, q.shape);
        ASSERT_EQ(p.patch, q.patch);
    }
    ASSERT_EQ(a.cells().size(), b.cells().size());
    for (std::size_t c = 0; c < a.cells().size(); ++c) {
        ASSERT_EQ(a.cells()[c].coord, b.cells()[c].coord);
        ASSERT_EQ(a.cells()[c].whole, b.cells()[c].whole);
        ASSERT_EQ(a.cells()[c].firstElement, b.cells()[c].firstElement);
        ASSERT_EQ(a.cells()[c].pieces.size(), b.cells()[c].pieces.size());
        for (std::size_t k = 0; k < a.cells()[c].pieces.size(); ++k) {
            const auto &p = a.cells()[c].pieces[k], &q = b.cells()[c].pieces[k];
            ASSERT_TRUE(p.subTet == q.subTet && p.element == q.element && p.cut.fraction == q.cut.fraction &&
                        p.cut.moment == q.cut.moment && p.cut.t == q.cut.t);
        }
    }
    const auto s = tetmesh::extractSurface(a), t = tetmesh::extractSurface(b);
    ASSERT_EQ(s.triangles, t.triangles);
    ASSERT_EQ(s.cutArea, t.cutArea);
    ASSERT_EQ(s.points.size(), t.points.size());
    for (std::size_t i = 0; i < s.points.size(); ++i)
        ASSERT_TRUE(s.points[i].node == t.points[i].node && s.points[i].weight == t.points[i].weight);
}

using Changes = std::vector<VoxelPhi>;

/// phi = max(phi, hole) over the box, as changes to the mesh; the capped band is kept.
inline Changes raised(const tetmesh::BodyMesh& mesh, Coord lower, Coord upper, const Phi& hole)
{
    const double dx = mesh.voxelSize();
    const float band = float(3 * dx);
    Changes changes;
    for (int z = lower.z; z <= upper.z; ++z)
        for (int y = lower.y; y <= upper.y; ++y)
            for (int x = lower.x; x <= upper.x; ++x) {
                const Coord c{x, y, z};
                const float value = std::clamp(float(hole(dx * c.toVec())), -band, band);
                if (value > mesh.phi()(c)) changes.push_back({c, value});
            }
    return changes;
}

inline Phi hollow(const Phi& solid)
{
    return [solid](Vec3 p) { return -solid(p); };
}

inline std::int64_t cellsTouched(const tetmesh::CutMesh& mesh, const Changes& changes)
{
    tetmesh::NodeField<float> after = mesh.phi();
    for (const auto& [c, value] : changes) after.set(c, value);
    const int m = mesh.lattice().coarsening;
    const double snap = tetmesh::kSnap * mesh.lattice().voxelSize;
    std::int64_t touched = 0;
    for (const auto& cell : mesh.cells()) {
        bool any = false;
        for (int z = 0; z <= m; ++z)
            for (int y = 0; y <= m; ++y)
                for (int x = 0; x <= m; ++x) {
                    const Coord c = m * cell.coord + Coord{x, y, z};
                    const double now = after(c), seen = std::abs(now) < snap ? 0 : now;
                    any = any || seen != mesh.seenPhi(c);
                }
        touched += any;
    }
    return touched;
}

inline std::vector<double> lumpedMass(const tetmesh::BodyMesh& mesh)
{
    std::vector<double> mass(mesh.nodeCount(), 0);
    for (const auto& e : mesh.elements()) {
        const auto& tets = tetmesh::cellTets(e.shape);
        for (int t = 0; t < tets.count; ++t)
            for (int c : tets.corner[std::size_t(t)])
                mass[e.node[std::size_t(c)]] += .25 * tets.volume[std::size_t(t)] * e.fraction[std::size_t(t)];
    }
    return mass;
}

inline std::size_t fragmentCount(const tetmesh::BodyMesh& mesh)
{
    std::uint32_t nextId = 0;
    return tetmesh::FragmentTracker(mesh, nextId).alive();
}

inline double sum(const std::vector<double>& values)
{
    double s = 0;
    for (double v : values) s += v;
    return s;
}

/// A mesh in which exactly the listed voxels are material, each surrounded by -dx | +dx crossings.
inline tetmesh::CutMesh fromVoxels(const tetmesh::Lattice& lattice, int reach, const std::set<Coord>& material)
{
    return {lattice, lab::sample({-reach, -reach, -reach}, {reach, reach, reach}, lattice.voxelSize, [&](Vec3 p) {
                const Coord c{int(std::lround(p.x() / lattice.voxelSize)), int(std::lround(p.y() / lattice.voxelSize)),
                              int(std::lround(p.z() / lattice.voxelSize))};
                return material.contains(c) ? -lattice.voxelSize : lattice.voxelSize;
            })};
}

/// Are two voxel nodes ends of an edge of some sub-tet?
inline bool joined(const tetmesh::Lattice& lattice, Coord a, Coord b)
{
    const int m = lattice.coarsening;
    const auto floorDiv = [m](int v) { return (v >= 0 ? v : v - m + 1) / m; };
    for (int dz = -1; dz <= 0; ++dz)
        for (int dy = -1; dy <= 0; ++dy)
            for (int dx = -1; dx <= 0; ++dx) {
                const Coord voxelCell = a + Coord{dx, dy, dz};
                const Coord cell{floorDiv(voxelCell.x), floorDiv(voxelCell.y), floorDiv(voxelCell.z)};
                const auto& tets = tetmesh::cellTets(lattice.shapeOf(cell));
                for (int t = 0; t < tets.count; ++t) {
                    bool hasA = false, hasB = false;
                    for (int c : tets.corner[std::size_t(t)]) {
                        const Coord v = voxelCell + tetmesh::cornerOffset(c);
                        hasA = hasA || v == a, hasB = hasB || v == b;
                    }
                    if (hasA && hasB) return true;
                }
            }
    return false;
}

}  // namespace vdbfrac::test
