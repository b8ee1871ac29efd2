// What holds the samples of a surface, from step to step and in a solve.
#include "contact_parts.h"

#include <vdbfrac/contact/trembling.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/infinity.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using namespace vdbfrac;
using contact::Pair;
using contact::Trembling;

namespace {

constexpr double kDx = 0.05;  // m

/// Two slabs that lie in each other by half a voxel.
struct Slabs {
    lab::SceneRun run{
        "version = 1\nname = \"slabs\"\n[grid]\nvoxel_size = 0.05\n[[body]]\nname = \"low\"\nmaterial = \"gel\"\n"
        "shape = { box = { size = [0.5, 0.2, 0.5] } }\n[[body]]\nname = \"high\"\nmaterial = \"gel\"\n"
        "shape = { box = { size = [0.3, 0.2, 0.3], center = [0.01, 0.175, 0.02], rotate = [3, 8, 5] } }\n"
        "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\n"};
    ContactParts parts{run.simulation.bodies(), 2 * kDx};
    const contact::ContactSurface& surface = parts.surface;
    const contact::Targets& targets = parts.targets;
    contact::NarrowPhase near;
    std::vector<Vec3> x{run.simulation.x().begin(), run.simulation.x().end()};

    /// By default samples may be as deep as they are.
    bool look(Trembling& trembling, const std::vector<Pair>& seen, double hidden = kInfinity) const
    {
        return trembling.look(seen, surface, targets, x, hidden);
    }

    Slabs() { near.find(surface, targets, {x, x}, {x, x}, kDx); }
};

bool operator==(const Pair& a, const Pair& b) { return a.sample == b.sample && a.target == b.target; }

TEST(Trembling, IsWhatGoesBackToWhereItHasJustComeFrom)
{
    const Slabs slabs;
    const auto isOf = [&](std::uint32_t t, std::uint32_t other) {
        return slabs.targets[t].fragment == slabs.targets[other].fragment;
    };
    const std::uint32_t a = 0, b = 1, other = std::uint32_t(slabs.targets.size() - 1);
    ASSERT_TRUE(isOf(a, b) && !isOf(a, other));
    const auto held = [&](const std::vector<Pair>& older, const std::vector<Pair>& last,
                          const std::vector<Pair>& seen) {
        Trembling trembling;
        trembling.keep(older), trembling.keep(last);
        const bool isFound = slabs.look(trembling, seen);
        EXPECT_EQ(isFound, !trembling.held().empty());
        EXPECT_FALSE(slabs.look(trembling, seen));  // again
        return std::vector<Pair>(trembling.held().begin(), trembling.held().end());
    };
    EXPECT_TRUE(std::ranges::equal(held({{5, a}, {7, a}}, {{5, b}, {7, a}}, {{5, a}, {7, b}}),
                                   std::vector<Pair>{{5, b}}, [](const Pair& p, const Pair& q) { return p == q; }));
    EXPECT_TRUE(held({{5, a}}, {{5, b}}, {{5, b}}).empty());                  // stays
    EXPECT_TRUE(held({{5, a}}, {{5, b}}, {{5, b + 1}}).empty());              // goes on
    EXPECT_TRUE(held({{5, a}}, {{6, b}}, {{5, a}}).empty());                  // was out
    EXPECT_TRUE(held({{5, other}}, {{5, b}}, {{5, b}, {5, other}}).empty());  // in two pieces
}

TEST(Trembling, EndsWhereASampleHasLeft)
{
    const Slabs slabs;
    Trembling trembling;
    trembling.keep({{{5, 0}}}), trembling.keep({{{5, 1}}});
    ASSERT_TRUE(slabs.look(trembling, {{5, 0}}));
    trembling.keep({{{5, 1}, {6, 2}}});
    EXPECT_EQ(trembling.held().size(), 1u);
    core::Archive archive;
    trembling.save("t", archive);
    Trembling restored;
    restored.restoreFrom("t", archive, 7, 3);
    EXPECT_EQ(restored.held().size(), 1u);
    EXPECT_THROW(restored.restoreFrom("t", archive, 6, 3), FileError);
    EXPECT_THROW(restored.restoreFrom("t", archive, 7, 2), FileError);
    trembling.keep({{{6, 2}}});
    EXPECT_TRUE(trembling.held().empty());
}

/// What a solve holds begins with what steps hold, and knows nothing else of them.
TEST(Trembling, OfASolveBeginsWithWhatStepsHold)
{
    const Slabs slabs;
    Trembling steps;
    steps.keep({{{5, 0}, {7, 0}}}), steps.keep({{{5, 1}, {7, 1}}});
    ASSERT_TRUE(slabs.look(steps, {{5, 0}}));
    Trembling solve(steps.held());
    solve.keep({{{5, 1}, {7, 1}}});
    EXPECT_FALSE(slabs.look(solve, {{5, 1}, {7, 0}}));
    solve.keep({{{5, 1}, {7, 0}}});
    EXPECT_TRUE(slabs.look(solve, {{5, 1}, {7, 1}}));
    EXPECT_EQ(solve.held().size(), 2u);
    EXPECT_EQ(steps.held().size(), 1u);
}

/// Held by a tet that sees it near its surface, a sample would sink into the one that it is in.
TEST(Trembling, HoldsWhereASampleIsDeeperThanIsHidden)
{
    constexpr double kReach = .1, kHidden = .05 * kDx;
    const Slabs s;
    const auto phi = [&](const Pair& p) { return s.targets.locate(p.target, s.surface.probe(p.sample, s.x), s.x).phi; };
    int deeper = 0;
    const std::vector<Pair> pairs = s.near.seenAt(s.surface, s.targets, s.x, kReach);
    for (const Pair& p : pairs)
        for (std::uint32_t t = 0; t < s.targets.size(); ++t) {
            const Pair other{p.sample, t};
            if (t == p.target || s.targets[t].fragment != s.targets[p.target].fragment || !(phi(p) < 0)) continue;
            if (!(std::abs(phi(other)) < kDx) || !(phi(p) < phi(other) - kHidden)) continue;
            for (const auto& [older, last] : {std::pair(p, other), {other, p}}) {
                Trembling trembling;
                trembling.keep({{older}}), trembling.keep({{last}});
                EXPECT_TRUE(s.look(trembling, {older}, kHidden));
                EXPECT_EQ(trembling.held()[0].target, p.target);
            }
            ++deeper;
        }
    EXPECT_GT(deeper, 100);
}

/// What is held is seen a little outside of its tet too, though a sample lies in another.
TEST(Trembling, HoldsWhatASampleIsALittleOutsideOf)
{
    constexpr double kReach = .1, kHeld = .2;
    const Slabs s;
    int held = 0, left = 0;
    const std::vector<Pair> pairs = s.near.seenAt(s.surface, s.targets, s.x, kReach);
    for (const Pair& p : std::span(pairs).first(std::min<std::size_t>(pairs.size(), 8))) {
        const Vec3 y = s.surface.probe(p.sample, s.x);
        for (std::uint32_t t = 0; t < s.targets.size(); ++t) {
            const double least = s.targets.leastShare(t, y, 1, s.x);
            if (t == p.target || s.targets[t].fragment != s.targets[p.target].fragment || least < -5 * kHeld) continue;
            const Pair other{p.sample, t};
            const auto seen = s.near.seenAt(s.surface, s.targets, s.x, kReach, std::span(&other, 1));
            const auto now = std::ranges::find(seen, p.sample, &Pair::sample);
            ASSERT_NE(now, seen.end());
            if (now->target == t) {
                EXPECT_GT(least, -kHeld - 1e-9);
                ++held;
            }
            left += now->target != t && least < -kHeld;
        }
    }
    EXPECT_GT(held, 10);
    EXPECT_GT(left, 10);
}

/// What a solve has pushed out of a tet is not forgotten, or it could come back deep, unseen; but what has long left
/// is.
TEST(NarrowPhase, KeepsWhatASolveHasPushedOut)
{
    const Slabs s;
    const std::vector<Pair> seen = s.near.seenAt(s.surface, s.targets, s.x, .1);
    ASSERT_GT(seen.size(), 20u);
    const auto kept = [&](std::span<const Pair> now, double way) {
        std::vector<Vec3> x = s.x;
        for (std::size_t n = s.run.simulation.bodies()[1].firstNode; n < x.size(); ++n) x[n].y() += way;
        return contact::withKnown(now, seen, s.surface, s.targets, x);
    };
    const auto same = [](const std::vector<Pair>& a, std::span<const Pair> b) {
        return std::ranges::equal(a, b, [](const Pair& p, const Pair& q) { return p == q; });
    };
    EXPECT_TRUE(same(kept({}, 0), seen));
    EXPECT_TRUE(same(kept(std::span(seen).first(7), 0), seen));
    EXPECT_TRUE(same(kept({}, .5 * kDx), seen));
    EXPECT_TRUE(kept({}, 10 * kDx).empty());
}

}  // namespace
