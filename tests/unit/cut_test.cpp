// One tet cut by a plane, and the tables of how a cell is divided into tets.
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

using namespace vdbfrac;
using tetmesh::CellShape;
using tetmesh::cutTet;
using tetmesh::TetCut;

namespace {

using Tet = std::array<Vec3, 4>;
using Values = std::array<double, 4>;

constexpr double kVolumes = 1e-12;  // relative to the tet: rounding of a few determinants of tets that are not slivers

double volumeOf(const Tet& v) { return std::abs((v[1] - v[0]).dot((v[2] - v[0]).cross(v[3] - v[0]))) / 6; }

Tet randomTet(std::mt19937& random)
{
    constexpr double kNoSliver = 0.02;  // of the unit cube's volume
    std::uniform_real_distribution<double> uniform(0, 1);
    Tet v;
    do
        for (Vec3& p : v)
            for (int d = 0; d < 3; ++d) p[d] = uniform(random);
    while (volumeOf(v) < kNoSliver);
    return v;
}

/// Of either sign, as small as 1e-18, or exactly 0.
double randomPhi(std::mt19937& random)
{
    std::uniform_real_distribution<double> exponent(-18, 0), uniform(-1, 1);
    switch (random() % 4) {
    case 0: return 0;
    case 1: return (random() & 1 ? 1 : -1) * std::pow(10, exponent(random));
    default: return uniform(random);
    }
}

Values negated(Values phi)
{
    for (double& p : phi) p = -p;
    return phi;
}

Vec3 cornerOf(const TetCut& cut, const Tet& v, int k)
{
    const auto [in, out] = cut.edge[std::size_t(k)];
    return v[in] + cut.t[std::size_t(k)] * (v[out] - v[in]);
}

TEST(CutTet, BothSidesMakeTheWhole)
{
    std::mt19937 random(1);
    for (int trial = 0; trial < 10000; ++trial) {
        const Tet v = randomTet(random);
        Values phi;
        for (double& p : phi) p = randomPhi(random);
        if (std::all_of(phi.begin(), phi.end(), [](double p) { return p == 0; })) continue;  // no side at all
        const TetCut in = cutTet(v, phi), out = cutTet(v, negated(phi));
        ASSERT_TRUE(in.fraction >= 0 && in.fraction <= 1) << in.fraction;
        ASSERT_TRUE(out.fraction >= 0 && out.fraction <= 1) << out.fraction;
        ASSERT_NEAR(in.fraction + out.fraction, 1, kVolumes);
        double moments = 0;
        for (std::size_t a = 0; a < 4; ++a) {
            ASSERT_GE(in.moment[a], 0);
            ASSERT_NEAR(in.moment[a] + out.moment[a], 0.25, kVolumes);
            moments += in.moment[a];
        }
        ASSERT_NEAR(moments, in.fraction, kVolumes);
    }
}

TEST(CutTet, UncutTetsAreAllOrNothing)
{
    const Tet v{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
    const TetCut full = cutTet(v, {-1, -2, -3, -1e-300}), none = cutTet(v, {0, 1, 2, 0});
    EXPECT_EQ(full.fraction, 1);
    EXPECT_EQ(full.polygonSize, 0);
    for (double m : full.moment) EXPECT_EQ(m, 0.25);
    EXPECT_EQ(none.fraction, 0);
    EXPECT_EQ(none.polygonSize, 0);
    for (double m : none.moment) EXPECT_EQ(m, 0);
}

TEST(CutTet, TinyCornersKeepTheirVolume)
{
    // One corner inside: the fraction is the product of the three crossings, also at 1e-18.
    constexpr double kPosition = 1e-9;  // relative: 1e-16 in a position, over a corner 1e-6 long, three times
    std::mt19937 random(2);
    for (double t : {1e-1, 1e-3, 1e-6}) {
        const Tet v = randomTet(random);
        const TetCut cut = cutTet(v, {-t, 1 - t, 1 - t, 1 - t});
        EXPECT_NEAR(cut.fraction, t * t * t, kPosition * t * t * t);
        const TetCut rest = cutTet(v, {t, t - 1, t - 1, t - 1});
        EXPECT_NEAR(rest.fraction, 1 - t * t * t, kVolumes);
    }
}

TEST(CutTet, PolygonLiesOnThePlaneAndFacesAwayFromMaterial)
{
    constexpr double kPlane = 1e-15;  // of the largest |phi|: rounding of one interpolation
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int trial = 0; trial < 10000; ++trial) {
        const Tet v = randomTet(random);
        Values phi;
        for (double& p : phi) p = trial % 2 ? uniform(random) : randomPhi(random);
        const TetCut cut = cutTet(v, phi);
        const auto inside = std::count_if(phi.begin(), phi.end(), [](double p) { return p < 0; });
        ASSERT_EQ(cut.polygonSize, inside % 4 == 0 ? 0 : inside == 2 ? 4 : 3);
        if (cut.polygonSize == 0) continue;
        Vec3 area = Vec3::Zero();
        for (int k = 0; k < cut.polygonSize; ++k) {
            const auto [in, out] = cut.edge[std::size_t(k)];
            const double t = cut.t[std::size_t(k)];
            ASSERT_TRUE(t >= 0 && t <= 1);
            ASSERT_TRUE(phi[in] < 0 && phi[out] >= 0);
            ASSERT_LE(std::abs(phi[in] + t * (phi[out] - phi[in])), kPlane);
            area += 0.5 * (cornerOf(cut, v, k) - v[0]).cross(cornerOf(cut, v, (k + 1) % cut.polygonSize) - v[0]);
        }
        // phi grows along the normal.
        Mat3 edges;
        Vec3 rise;
        for (int k = 0; k < 3; ++k) {
            edges.row(k) = v[std::size_t(k + 1)] - v[0];
            rise[k] = phi[std::size_t(k + 1)] - phi[0];
        }
        const Vec3 gradient = edges.fullPivLu().solve(rise).normalized();
        constexpr double kFlat = 1e-12;  // area below which its direction is rounding
        if (area.norm() > kFlat) {
            ASSERT_GT(area.normalized().dot(gradient), 1 - 1e-3);
        }
    }
}

TEST(CutTet, TheSameEdgeGivesTheSameCrossingInEveryTet)
{
    std::mt19937 random(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int trial = 0; trial < 200; ++trial) {
        const Tet v = randomTet(random);
        Values phi;
        for (double& p : phi) p = uniform(random);
        const TetCut first = cutTet(v, phi);
        std::array<std::size_t, 4> order{0, 1, 2, 3};
        do {
            Tet w;
            Values psi;
            for (std::size_t a = 0; a < 4; ++a) w[a] = v[order[a]], psi[a] = phi[order[a]];
            const TetCut cut = cutTet(w, psi);
            ASSERT_EQ(cut.polygonSize, first.polygonSize);
            for (std::size_t k = 0; k < std::size_t(cut.polygonSize); ++k)
                for (std::size_t j = 0; j < std::size_t(cut.polygonSize); ++j)
                    if (order[cut.edge[k][0]] == first.edge[j][0] && order[cut.edge[k][1]] == first.edge[j][1]) {
                        ASSERT_EQ(cut.t[k], first.t[j]);
                    }
            ASSERT_NEAR(cut.fraction, first.fraction, kVolumes);
        } while (std::next_permutation(order.begin(), order.end()));
    }
}

// --- exact arithmetic ----------------------------------------------------------------------------------------------

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;

/// Material volume / tet volume in exact arithmetic: the hull of the inside vertices and the crossings.
double exactFraction(const Tet& v, const Values& phi)
{
    const auto point = [&](std::size_t a) { return Exact::Point_3(v[a].x(), v[a].y(), v[a].z()); };
    std::vector<Exact::Point_3> corners;
    for (std::size_t i = 0; i < 4; ++i) {
        if (phi[i] >= 0) continue;
        corners.push_back(point(i));
        for (std::size_t o = 0; o < 4; ++o) {
            if (phi[o] < 0) continue;
            const Exact::FT a(phi[i]), b(phi[o]);
            corners.push_back(point(i) + a / (a - b) * (point(o) - point(i)));
        }
    }
    if (corners.empty()) return 0;
    CGAL::Surface_mesh<Exact::Point_3> hull;
    CGAL::convex_hull_3(corners.begin(), corners.end(), hull);
    Exact::FT sum = 0;
    for (const auto face : hull.faces()) {
        std::vector<Exact::Point_3> p;
        for (const auto vertex : hull.vertices_around_face(hull.halfedge(face))) p.push_back(hull.point(vertex));
        for (std::size_t k = 2; k < p.size(); ++k) sum += CGAL::volume(corners[0], p[0], p[k - 1], p[k]);
    }
    return CGAL::to_double(CGAL::abs(sum) / CGAL::abs(CGAL::volume(point(0), point(1), point(2), point(3))));
}

TEST(CutTet, VolumeMatchesExactArithmetic)
{
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int trial = 0; trial < 300; ++trial) {
        const Tet v = randomTet(random);
        Values phi;
        for (double& p : phi) p = trial % 3 ? uniform(random) : randomPhi(random);
        if (trial % 3 == 0)  // coplanar corners have no hull to speak of: keep one vertex properly inside
            phi[random() % 4] = -0.5;
        ASSERT_NEAR(cutTet(v, phi).fraction, exactFraction(v, phi), kVolumes);
    }
}

// --- tables --------------------------------------------------------------------------------------------------------

constexpr CellShape kShapes[] = {CellShape::six, CellShape::fiveEven, CellShape::fiveOdd};

Vec3 corner(int c) { return Vec3(c & 1, c >> 1 & 1, c >> 2 & 1); }

TEST(CellTets, VolumesFillTheCell)
{
    for (CellShape shape : kShapes) {
        const auto& cell = tetmesh::cellTets(shape);
        EXPECT_EQ(cell.count, shape == CellShape::six ? 6 : 5);
        double sum = 0;
        for (int t = 0; t < cell.count; ++t) {
            Tet v;
            for (std::size_t a = 0; a < 4; ++a) v[a] = corner(cell.corner[std::size_t(t)][a]);
            EXPECT_DOUBLE_EQ(cell.volume[std::size_t(t)], volumeOf(v));
            EXPECT_GT((v[1] - v[0]).dot((v[2] - v[0]).cross(v[3] - v[0])), 0);  // wound alike
            sum += cell.volume[std::size_t(t)];
        }
        EXPECT_DOUBLE_EQ(sum, 1);
    }
}

TEST(CellTets, GradientsSumToZeroAndReproduceLinearFunctions)
{
    const Vec3 slope(0.3, -1.7, 2.9);
    for (CellShape shape : kShapes) {
        const auto& cell = tetmesh::cellTets(shape);
        for (int t = 0; t < cell.count; ++t) {
            Vec3 sum = Vec3::Zero(), found = Vec3::Zero();
            for (std::size_t a = 0; a < 4; ++a) {
                const auto& g = cell.gradient[std::size_t(t)][a];
                sum += Vec3(g[0], g[1], g[2]);
                found += (1.3 + slope.dot(corner(cell.corner[std::size_t(t)][a]))) * Vec3(g[0], g[1], g[2]);
            }
            EXPECT_LT(sum.norm(), 1e-15);
            EXPECT_LT((found - slope).norm(), 1e-14);
        }
    }
}

/// Triangles of a cell on its face at coordinate `side` of an axis, in the cell's corners seen from the neighbour.
std::set<std::set<int>> faceTriangles(CellShape shape, int axis, int side, int flip)
{
    std::set<std::set<int>> faces;
    const auto& cell = tetmesh::cellTets(shape);
    for (int t = 0; t < cell.count; ++t) {
        std::set<int> face;
        for (int c : cell.corner[std::size_t(t)])
            if ((c >> axis & 1) == side) face.insert(c ^ (flip << axis));
        if (face.size() == 3) faces.insert(face);
    }
    return faces;
}

TEST(CellTets, NeighboursShareTheirFaces)
{
    using tetmesh::Lattice;
    for (Lattice::Kind kind : {Lattice::Kind::six, Lattice::Kind::five})
        for (int parity = 0; parity < 2; ++parity)
            for (int axis = 0; axis < 3; ++axis) {
                const Lattice lattice{kind, 1, 1};
                const Coord here{parity, 0, 0};
                const Coord there = here + Coord{axis == 0, axis == 1, axis == 2};
                const auto mine = faceTriangles(lattice.shapeOf(here), axis, 1, 0);
                EXPECT_EQ(mine.size(), 2u);
                EXPECT_EQ(mine, faceTriangles(lattice.shapeOf(there), axis, 0, 1));
            }
}

TEST(CellTets, ShapesFollowParityAlsoBelowZero)
{
    const tetmesh::Lattice five{tetmesh::Lattice::Kind::five, 1, 1};
    EXPECT_EQ(five.shapeOf({-1, 0, 0}), CellShape::fiveOdd);
    EXPECT_EQ(five.shapeOf({-1, -1, 0}), CellShape::fiveEven);
    EXPECT_EQ(five.shapeOf({-3, 1, -1}), CellShape::fiveOdd);
}

}  // namespace
