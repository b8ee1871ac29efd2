// The outer surface less the cracks, against CGAL's booleans of the same two surfaces.
#include "crack_lattice.h"
#include "torn_solids.h"

#include <vdbfrac/tetmesh/nodes_around.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/intersections.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace vdbfrac::skin {
namespace {

using namespace test;
namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Vertex = Mesh::Vertex_index;

Point pointAt(const Vec3& X) { return {X.x(), X.y(), X.z()}; }

Mesh meshOf(const std::vector<Vec3>& points, const Triangles& triangles)
{
    Mesh mesh;
    for (const Vec3& X : points) mesh.add_vertex(pointAt(X));
    for (const auto& t : triangles) mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
    return mesh;
}

/// The surface of all that has c > 0, by the corners of its polygon in each tet.
Mesh crackOf(const CrackField& cracks, double dx)
{
    const CrackLattice lattice(cracks.c, cracks.c, dx);
    Mesh mesh;
    std::map<SimplexKey, Vertex> vertices;
    std::vector<Coord> nodes;
    cracks.c.forEachBlock(
        [&](const Coord& low) { cracks.c.forEachNode(low, [&](const Coord& n) { nodes.push_back(n); }); });
    for (const Coord& voxel : tetmesh::nodesAround(nodes, 1))
        for (int k = 0; k < 6; ++k) {
            const LatticeTet tet = CrackLattice::tet(voxel, k);
            std::vector<int> open, closed;
            for (int a = 0; a < 4; ++a) (lattice.isOpen(tet.node[std::size_t(a)]) ? open : closed).push_back(a);
            if (open.empty() || closed.empty()) continue;
            const auto at = [&](int a) { return lattice.position(tet.node[std::size_t(a)]); };
            const auto crossing = [&](int a, int b) {
                const double ca = lattice.c(tet.node[std::size_t(a)]), cb = lattice.c(tet.node[std::size_t(b)]);
                const auto [it, isNew] =
                    vertices.emplace(lattice.edgeKey(tet, std::min(a, b), std::max(a, b)), Vertex());
                if (isNew) it->second = mesh.add_vertex(pointAt(at(a) + ca / (ca - cb) * (at(b) - at(a))));
                return it->second;
            };
            std::vector<Vertex> round;
            for (std::size_t i = 0; i < closed.size(); ++i)
                for (std::size_t j = 0; j < open.size(); ++j)
                    round.push_back(crossing(closed[i], open[i % 2 == 0 ? j : open.size() - 1 - j]));
            const auto place = [&](std::size_t i) {
                const Point& p = mesh.point(round[i]);
                return Vec3(p.x(), p.y(), p.z());
            };
            const Vec3 normal = (place(1) - place(0)).cross(place(2) - place(0));
            if (normal.dot(at(closed[0]) - at(open[0])) < 0) std::reverse(round.begin(), round.end());
            for (std::size_t i = 2; i < round.size(); ++i) mesh.add_face(round[0], round[i - 1], round[i]);
        }
    return mesh;
}

/// What a crack takes and what it leaves of the outer surface is all of it, and both are what CGAL finds.
TEST(SkinOracle, KeepsAndRemovesWhatBooleansDo)
{
    constexpr double kRounding = 1e-9, dx = .1;
    for (const Solid& solid : {box(1, 1), box(.97, 23), ball(1, 30), rod(kTilts[3], 40)})
        for (const Vec3& normal : kTilts)
            for (const double ends : {1e9, .2}) {
                SCOPED_TRACE(solid.name + ", ends " + std::to_string(ends));
                const SkinCut cut = cutBy(solid, {normal, .03, ends}, dx);
                const Drawn d = drawn(solid, cut);
                Mesh whole = meshOf(solid.points, solid.triangles), crack = crackOf(cut.cracks, dx);
                ASSERT_TRUE(CGAL::is_closed(crack));
                ASSERT_TRUE(PMP::is_outward_oriented(crack));
                Mesh left, taken;
                Mesh whole2 = whole, crack2 = crack;
                ASSERT_TRUE(PMP::corefine_and_compute_difference(whole, crack, left));
                ASSERT_TRUE(PMP::corefine_and_compute_intersection(whole2, crack2, taken));
                EXPECT_NEAR(volume(d), PMP::volume(left), kRounding);
                const double skin = area(solid.points, solid.triangles), kept = area(d.points, d.outside),
                             faces = area(d.points, d.torn);
                EXPECT_NEAR(kept + faces, PMP::area(left), kRounding);
                const double removed = PMP::area(taken) - faces;
                EXPECT_NEAR(kept + removed, skin, kRounding);
                EXPECT_GT(removed, .02 * skin);
            }
}

/// All that a triangle meets, and of one longer than a few voxels hardly any other: of thin ones too, however they lie.
TEST(SkinOracle, VoxelsOfATriangleAreThoseThatItMeets)
{
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> anywhere(-1, 1);
    const auto somewhere = [&] { return Vec3(anywhere(random), anywhere(random), anywhere(random)); };
    for (int round = 0; round < 300; ++round) {
        const double size = round % 3 == 0 ? .4 : round % 3 == 1 ? 3 : 12, width = round % 2 == 0 ? size : .01;
        const Vec3 a = size * somewhere(), b = a + 2 * size * somewhere();
        const std::array<Vec3, 3> corners{a, b, 0.5 * (a + b) + width * somewhere()};
        const Kernel::Triangle_3 triangle(pointAt(corners[0]), pointAt(corners[1]), pointAt(corners[2]));
        std::set<Coord> visited;
        VoxelsOfTriangle(corners).visit([&](Coord c) { EXPECT_TRUE(visited.insert(c).second); });
        const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
                   high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
        const bool isLarge = (high - low).maxCoeff() > 4;
        for (int z = int(std::floor(low.z())) - 1; z <= high.z() + 1; ++z)
            for (int y = int(std::floor(low.y())) - 1; y <= high.y() + 1; ++y)
                for (int x = int(std::floor(low.x())) - 1; x <= high.x() + 1; ++x) {
                    const auto meets = [&](double more) {
                        return CGAL::do_intersect(
                            CGAL::Bbox_3(x - more, y - more, z - more, x + 1 + more, y + 1 + more, z + 1 + more),
                            triangle);
                    };
                    const bool isVisited = visited.contains({x, y, z});
                    EXPECT_TRUE(isVisited || !meets(0)) << round;
                    EXPECT_TRUE(!isVisited || !isLarge || meets(1e-4)) << round;
                }
    }
}

}  // namespace
}  // namespace vdbfrac::skin
