// The lattices of multigrid: what each level must keep of the finer one, and what cracks must part on all of them.
#include "case.h"
#include "lattice_levels.h"

#include <vdbfrac/base/hash.h>
#include <vdbfrac/lab/samples/crack.h>
#include <vdbfrac/lab/samples/solid.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <ostream>
#include <string>

using namespace vdbfrac;
using lab::Block;
using solver::CoarseLattice;
using test::Classes;
using test::Hierarchy;
using test::View;
using Kind = tetmesh::Lattice::Kind;

namespace {

int halved(int i) { return i >= 0 ? i / 2 : -((1 - i) / 2); }
Coord halved(Coord c) { return {halved(c.x), halved(c.y), halved(c.z)}; }

using Case = test::Case<std::vector<Block>>;
constexpr auto nameOf = test::nameOf<std::vector<Block>>;

/// Calls f(finer lattice, coarser one, both as views) for each pair of levels.
class Coarsening : public testing::TestWithParam<Case> {
protected:
    template <class F>
    void eachLevel(const F& f) const
    {
        const Hierarchy h(GetParam().make());
        for (std::size_t l = 0; l + 1 < h.levels.size(); ++l) {
            SCOPED_TRACE("level " + std::to_string(l));
            const auto &fine = h.levels[l], &coarse = h.levels[l + 1];
            f(fine.coarser, View(fine.sets, fine.nodeCount), View(coarse.sets, coarse.nodeCount));
        }
    }
};

TEST_P(Coarsening, EveryFinerElementIsInOneCoarseElementOfItsCellAndBody)
{
    eachLevel([](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        const auto& finer = lattice.finer;
        ASSERT_EQ(finer.start.size(), coarse.elements.size() + 1);
        ASSERT_EQ(finer.start.front(), 0u);
        ASSERT_EQ(finer.start.back(), finer.children.size());
        std::vector<int> times(fine.elements.size(), 0);
        for (std::size_t e = 0; e < coarse.elements.size(); ++e) {
            EXPECT_LT(finer.start[e], finer.start[e + 1]);
            for (std::size_t c = finer.start[e]; c < finer.start[e + 1]; ++c) {
                const auto& child = fine.elements[finer.children[c]];
                ++times[finer.children[c]];
                EXPECT_EQ(halved(child.cell), coarse.elements[e].cell);
                EXPECT_EQ(child.set, coarse.elements[e].set);
            }
        }
        for (int t : times) EXPECT_EQ(t, 1);
    });
}

TEST_P(Coarsening, CoarseElementsAreWhatHangsTogetherByNodes)
{
    eachLevel([](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        const auto& finer = lattice.finer;
        std::map<std::pair<Coord, std::uint32_t>, std::size_t> ownerOf;  // by coarse cell and finer node
        for (std::size_t e = 0; e < coarse.elements.size(); ++e) {
            Classes classes(finer.start[e + 1] - finer.start[e]);
            std::map<std::uint32_t, std::size_t> first;
            for (std::size_t c = finer.start[e]; c < finer.start[e + 1]; ++c)
                for (std::uint32_t n : fine.elements[finer.children[c]].node) {
                    const auto [at, isNew] = first.insert({n, c - finer.start[e]});
                    if (!isNew) classes.join(c - finer.start[e], at->second);
                    const auto owner = ownerOf.insert({{coarse.elements[e].cell, n}, e}).first->second;
                    EXPECT_EQ(owner, e) << "two elements of one coarse cell share node " << n;
                }
            for (std::size_t c = 0; c < classes.parent.size(); ++c) EXPECT_EQ(classes.find(c), classes.find(0));
        }
    });
}

/// The tet of the coarse cell in which the middle of tet t of a finer element lies.
std::size_t coarseTetRound(const View::Element& e, std::size_t t)
{
    Vec3 middle = Vec3::Zero();
    // Four, in a cell of two.
    for (int c : tetmesh::cellTets(e.shape).corner[t]) middle += (e.cell + tetmesh::cornerOffset(c)).toVec() / 8;
    return tetmesh::kuhnTetOf(middle - halved(e.cell).toVec());
}

TEST_P(Coarsening, VolumesAreKept)
{
    constexpr double kRounding = 1e-14;  // of a cell's volume: sums of up to 48 tets
    eachLevel([](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        const auto& finer = lattice.finer;
        for (std::size_t e = 0; e < coarse.elements.size(); ++e) {
            std::array<double, 6> tets{};
            for (std::size_t c = finer.start[e]; c < finer.start[e + 1]; ++c) {
                const auto& child = fine.elements[finer.children[c]];
                for (std::size_t t = 0; t < 6; ++t)
                    if (child.tetVolume[t] > 0) tets[coarseTetRound(child, t)] += child.tetVolume[t] / 8;
            }
            for (std::size_t t = 0; t < 6; ++t) EXPECT_NEAR(coarse.elements[e].tetVolume[t], tets[t], kRounding);
        }
    });
}

TEST_P(Coarsening, ParentsAreCornersOfEveryElementRoundTheNode)
{
    eachLevel([](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        ASSERT_EQ(lattice.parents.size(), fine.at.size());
        for (std::size_t e = 0; e < coarse.elements.size(); ++e)
            for (std::size_t c = lattice.finer.start[e]; c < lattice.finer.start[e + 1]; ++c) {
                const auto& child = fine.elements[lattice.finer.children[c]];
                for (std::size_t k = 0; k < 8; ++k) {
                    if (!child.used[k]) continue;
                    for (std::uint32_t parent : lattice.parents[child.node[k]]) {
                        const auto& corners = coarse.elements[e].node;
                        EXPECT_NE(std::find(corners.begin(), corners.end(), parent), corners.end());
                    }
                }
            }
    });
}

TEST_P(Coarsening, LinearFieldsAreInterpolatedExactly)
{
    Mat3 G;
    G << 1, -2, 3, .5, 4, -1, 2, .25, -3;  // numbers of few bits: the arithmetic is exact
    const Vec3 a(1, 2, -5);
    const auto field = [&](Coord c, double h) { return Vec3(a + G * (h * c.toVec())); };
    eachLevel([&](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        for (std::size_t n = 0; n < fine.at.size(); ++n) {
            const auto [p, q] = lattice.parents[n];
            if (p >= coarse.at.size()) continue;  // a node that no tet uses
            EXPECT_EQ(Vec3((field(coarse.at[p], 2) + field(coarse.at[q], 2)) / 2), field(fine.at[n], 1)) << n;
        }
    });
}

/// A corner is shared only between elements that a chain of finer nodes joins, each of which takes its value from it.
TEST_P(Coarsening, CornersAreSharedOnlyThroughFinerNodes)
{
    eachLevel([](const CoarseLattice& lattice, const View& fine, const View& coarse) {
        std::vector<std::vector<std::size_t>> roundNode(fine.at.size()), roundCorner(coarse.at.size());
        for (std::size_t e = 0; e < coarse.elements.size(); ++e) {
            for (std::uint32_t corner : coarse.elements[e].node) roundCorner[corner].push_back(e);
            for (std::size_t c = lattice.finer.start[e]; c < lattice.finer.start[e + 1]; ++c) {
                const auto& child = fine.elements[lattice.finer.children[c]];
                for (std::size_t k = 0; k < 8; ++k)
                    if (child.used[k]) roundNode[child.node[k]].push_back(e);
            }
        }
        std::vector<std::vector<std::uint32_t>> under(coarse.at.size());
        for (std::uint32_t n = 0; n < fine.at.size(); ++n)
            for (std::uint32_t parent : lattice.parents[n])
                if (parent < under.size()) under[parent].push_back(n);
        Classes classes(coarse.elements.size());
        for (std::size_t corner = 0; corner < under.size(); ++corner) {
            for (std::size_t e : roundCorner[corner]) classes.parent[e] = e;
            for (std::uint32_t n : under[corner])
                for (std::size_t e : roundNode[n]) classes.join(e, roundNode[n][0]);
            for (std::size_t e : roundCorner[corner]) EXPECT_EQ(classes.find(e), classes.find(roundCorner[corner][0]));
        }
    });
}

TEST_P(Coarsening, IsTheSameEveryTime)
{
    const auto fingerprint = [] {
        const Hierarchy h(GetParam().make());
        std::uint64_t hash = 0;
        for (const auto& level : h.levels) {
            hash = hashOf(std::span<const std::array<std::uint32_t, 2>>(level.coarser.parents), hash);
            hash = hashOf(std::span<const std::uint32_t>(level.coarser.finer.start), hash);
            hash = hashOf(std::span<const std::uint32_t>(level.coarser.finer.children), hash);
            for (const auto& set : level.coarser.sets) {
                hash = hashOf(std::span<const Coord>(set.nodes), hash);
                for (const auto& e : set.elements) {
                    hash = hashOf(std::span<const std::uint32_t>(e.node), hash);
                    hash = hashOf(std::span<const double>(e.fraction), hash);
                }
            }
        }
        return hash;
    };
    EXPECT_EQ(fingerprint(), fingerprint());
}

/// Open inside only: a rim of two cells holds the halves together.
bool inside(Coord c) { return c.x > 2 && c.x < 14 && c.y > 2 && c.y < 14; }

std::vector<Block> cracked(int plane, bool (*open)(Coord))
{
    Block block({16, 16, 12}, 1);
    lab::openCrack(block, {&Coord::z, plane}, open);
    return {block};
}

std::vector<Block> slitBox(Kind kind)
{
    const tetmesh::Lattice lattice{kind, 1, 1};
    const auto phi = [](Vec3 p) {
        const double box = (p.cwiseAbs() - Vec3(7.3, 6.2, 5.4)).maxCoeff();
        const double slit = std::max(std::abs(p.z() - p.x() / 4) - .8, p.head<2>().norm() - 4.5);
        return std::max(box, -slit);
    };
    return {lab::asBlock(tetmesh::CutMesh(lattice, lab::sample({-9, -8, -7}, {9, 8, 7}, 1, phi)))};
}

std::vector<Block> twoBodies()
{
    Block block({5, 6, 7}, 1), other({6, 5, 4}, 1);  // in the same place
    for (Coord& c : other.nodes) c = c - Coord{3, 3, 3};
    return {block, other};
}

INSTANTIATE_TEST_SUITE_P(
    Solids, Coarsening,
    testing::Values(Case{"block",
                         [] {
                             return std::vector<Block>{Block({9, 8, 11}, 1)};
                         }},
                    Case{"five",
                         [] {
                             return std::vector<Block>{Block({9, 8, 11}, 1, Kind::five)};
                         }},
                    Case{"crackOnCoarseNodes", [] { return cracked(6, inside); }},
                    Case{"crackBetweenCoarseNodes", [] { return cracked(5, inside); }},
                    Case{"ball",
                         [] {
                             return std::vector<Block>{lab::asBlock(lab::cutBall({Kind::six, 1, 1}, 7.3))};
                         }},
                    Case{"ballOfFive",
                         [] {
                             return std::vector<Block>{lab::asBlock(lab::cutBall({Kind::five, 1, 1}, 7.3))};
                         }},
                    Case{"slitBox", [] { return slitBox(Kind::six); }},
                    Case{"slitBoxOfFive", [] { return slitBox(Kind::five); }}, Case{"twoBodiesInOnePlace", twoBodies}),
    nameOf);

/// Which sides of the plane there is material on, in and under each element and node of each level.
struct Sides {
    enum : int { below = 1, above = 2, both = 3 };
    std::vector<std::vector<int>> element, node;

    Sides(const Hierarchy& h, int plane)
    {
        const View top(h.levels[0].sets, h.levels[0].nodeCount);
        element.emplace_back();
        node.emplace_back(top.at.size(), 0);
        for (const auto& e : top.elements) {
            element[0].push_back(e.cell.z < plane ? below : above);
            for (std::uint32_t n : e.node) node[0][n] |= element[0].back();
        }
        for (std::size_t l = 0; l + 1 < h.levels.size(); ++l) {
            const CoarseLattice& lattice = h.levels[l].coarser;
            element.emplace_back(lattice.finer.start.size() - 1, 0);
            node.emplace_back(lattice.nodeCount, 0);
            for (std::size_t e = 0; e + 1 < lattice.finer.start.size(); ++e)
                for (std::size_t c = lattice.finer.start[e]; c < lattice.finer.start[e + 1]; ++c)
                    element[l + 1][e] |= element[l][lattice.finer.children[c]];
            for (std::size_t n = 0; n < lattice.parents.size(); ++n)
                for (std::uint32_t parent : lattice.parents[n])
                    if (parent < lattice.nodeCount) node[l + 1][parent] |= node[l][n];
        }
    }
};

TEST(CoarseningOfCracks, HalvesStayApartOnAllLevels)
{
    for (int plane : {8, 7, 6, 4, 3, 1}) {
        const Hierarchy h(cracked(plane, [](Coord) { return true; }));
        const Sides sides(h, plane);
        for (std::size_t l = 0; l < h.levels.size(); ++l) {
            EXPECT_EQ(std::count(sides.element[l].begin(), sides.element[l].end(), Sides::both), 0)
                << plane << " " << l;
            EXPECT_EQ(std::count(sides.node[l].begin(), sides.node[l].end(), Sides::both), 0) << plane << " " << l;
        }
    }
}

/// A cell that holds the front of the crack parts nothing, so all of its corners are front on its level, and cells that
/// touch these are whole on the next: the crack ends within two cells of its true front on every level.
TEST(CoarseningOfCracks, SidesOfAnInteriorCrackMeetOnlyAtItsFront)
{
    constexpr int kSide = 32, kFront = 2;
    const auto open = [](Coord c) { return std::min({c.x, c.y, kSide - c.x, kSide - c.y}) > kFront; };
    for (int plane : {8, 7, 6, 5}) {
        Block block({kSide, kSide, 12}, 1);
        lab::openCrack(block, {&Coord::z, plane}, open);
        const Hierarchy h({block});
        const Sides sides(h, plane);
        int front = kFront;
        for (std::size_t l = 1; l < h.levels.size(); ++l) {
            const int size = 1 << l;
            front = size * (front / size + 1);
            EXPECT_LE(front - kFront, 2 * size);
            const View view(h.levels[l].sets, h.levels[l].nodeCount);
            int parted = 0;
            for (std::size_t e = 0; e < view.elements.size(); ++e) {
                const Coord low = size * view.elements[e].cell, high = low + size * Coord{1, 1, 1};
                if (std::min({low.x, low.y, kSide - high.x, kSide - high.y}) < front) continue;
                EXPECT_NE(sides.element[l][e], Sides::both) << "plane " << plane << " level " << l;
                parted += low.z < plane && high.z > plane;
            }
            const int across = (kSide - 2 * front) / size;
            EXPECT_EQ(parted, plane % size ? 2 * across * across : 0) << "plane " << plane << " level " << l;
        }
    }
}

TEST(CoarseningOfBlocks, WholeCellsStayWhole)
{
    const Hierarchy h({Block({16, 8, 8}, 1)});
    for (const auto& level : h.levels)
        for (const auto& e : level.sets[0].elements)
            for (double fraction : e.fraction) EXPECT_EQ(fraction, 1);
    EXPECT_EQ(h.levels[3].sets[0].elements.size(), 2u);
    EXPECT_EQ(h.levels[3].nodeCount, 3u * 2 * 2);
}

}  // namespace
