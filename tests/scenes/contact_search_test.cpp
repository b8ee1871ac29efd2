// Which tets the samples of a surface see.
#include "contact_parts.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/contact/narrow_phase.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace vdbfrac;

namespace {

constexpr double kDx = 0.05, kBottom = -.3;  // m; below that nothing is cut

/// Cuts a column out of a block on two sides, along x = 0 and y = 0, and leaves it standing.
class ColumnCutter : public core::Effect, public core::GridStage {
public:
    std::string name() const override { return "column_cutter"; }
    void join(core::Stages& stages) override { stages.grid.push_back(this); }
    grid::PhiChanges update(const core::GridContext&, const core::Body& body, grid::LevelSet& grid) override
    {
        if (done_) return {};
        done_ = true;
        grid::PhiChanges raised;
        const tetmesh::NodeField<float>& phi = body.mesh->phi();
        phi.forEachBlock([&](Coord low) {
            phi.forEachNode(low, [&](Coord c) {
                const Vec3 X = kDx * c.toVec();
                const double toX = std::hypot(X.x(), std::max(X.y(), 0.)), toY = std::hypot(X.y(), std::max(X.x(), 0.));
                const double slab = std::min(.6 * kDx - std::min(toX, toY), X.z() - kBottom);
                if (phi(c) < 0 && slab > phi(c)) raised.emplace_back(c, float(slab));
            });
        });
        grid::RelevelWork work;
        return grid::raiseAndRelevel(grid, raised, work);
    }

private:
    bool done_ = false;
};

/// Of each node: is it of the column? `above` [m]: where column and block are apart.
std::vector<bool> nodesOfColumn(const core::Body& body, double above)
{
    DisjointSets sets(body.mesh->nodeCount());
    std::vector<bool> isAbove(body.mesh->nodeCount(), false);
    for (const tetmesh::CellElement& e : body.mesh->elements()) {
        const auto low = std::ranges::min(e.node, {}, [&](std::uint32_t n) { return body.mesh->restPosition(n).z(); });
        if (body.mesh->restPosition(low).z() < above) continue;
        for (const std::uint32_t n : e.node) sets.join(e.node[0], n), isAbove[n] = true;
    }
    std::uint32_t in = 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::uint32_t n = 0; n < isAbove.size(); ++n) {
        const double d = (body.mesh->restPosition(n) - Vec3(-.25, -.25, .25)).norm();
        if (isAbove[n] && d < nearest) nearest = d, in = n;
    }
    std::vector<bool> isColumn(isAbove.size());
    for (std::uint32_t n = 0; n < isAbove.size(); ++n) isColumn[n] = isAbove[n] && sets.find(n) == sets.find(in);
    return isColumn;
}

/// Round the edge of a column that a crack has cut out, what faces the side of the column is not its neighbourhood:
/// they hang together far below only. It looks across the crack at an angle, as lips of any crack do that is not
/// straight.
TEST(ContactSearch, SeeAcrossACrackAtAnAngle)
{
    ColumnCutter cutter;
    lab::SceneRun run(
        "version = 1\nname = \"block\"\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.05\n[[body]]\n"
        "name = \"block\"\nmaterial = \"gel\"\nshape = { box = { size = [1, 1, 1] } }\n"
        "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n",
        {}, &cutter);
    run.step();
    const auto bodies = run.simulation.bodies();
    ASSERT_EQ(run.simulation.fragments(), 1u);
    const ContactParts parts(bodies, 2 * kDx);
    const contact::ContactSurface& surface = parts.surface;
    const contact::Targets& targets = parts.targets;

    const std::vector<bool> isColumn = nodesOfColumn(bodies[0], 0);
    std::vector<Vec3> x = tetmesh::restPositions(*bodies[0].mesh);
    for (std::size_t n = 0; n < x.size(); ++n)
        if (isColumn[n]) x[n] += kDx * Vec3(-.5, 1.9, 0);  // its side goes into what is behind the other crack
    contact::NarrowPhase near;
    near.find(surface, targets, {x, x}, {x, x}, .1 * kDx);
    const std::vector<double> depth = contact::deepest(near.penetrationsAt(surface, targets, x, .01), surface.size());
    const auto phi = grid::phiSampler(bodies[0].phi);
    int inside = 0, seen = 0;
    for (std::size_t i = 0; i < surface.size(); ++i) {
        const auto& nodes = surface.point(i).node;
        const Vec3 at = surface.at(i, x);
        const bool ofColumn = std::ranges::all_of(nodes, [&](std::uint32_t n) { return isColumn[n]; });
        const bool ofItsSide = surface.restNormal(i).x() > .8 && surface.restPosition(i).z() > .1;
        if (!ofColumn || !ofItsSide || !(phi(at) < -.2 * kDx) || at.y() < 0) continue;
        ++inside;
        seen += depth[i] > 0;
    }
    EXPECT_GT(inside, 5);
    EXPECT_EQ(seen, inside);
}

/// Two slabs side by side, at the same speed, of which what is below stops or throws the lower one in the first step:
/// they come nearer to each other than their speeds let expect. The deepest that they are in each other [m].
double deepestOfSlabs(const std::string& velocity, const std::string& heightOfUpper, const std::string& moveOfFloor)
{
    const auto slab = [&](const std::string& name, const std::string& y) {
        return "[[body]]\nname = \"" + name + "\"\nmaterial = \"gel\"\nvelocity = " + velocity +
               "\nshape = { box = { size = [0.5, 0.2, 0.5], center = [0, " + y + ", 0] } }\n";
    };
    lab::SceneRun run(
        "version = 1\nname = \"slabs\"\n[time]\nframes = [1, 6]\nfps = 24\nsubsteps = 1\n[grid]\nvoxel_size = 0.05\n" +
        slab("low", "0.16") + slab("high", heightOfUpper) +
        "[material.gel]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\n[[collider]]\nname = "
        "\"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\n" +
        moveOfFloor);
    double deepest = 0;
    while (!run.atEnd()) deepest = std::max(deepest, run.step().measured.at("contact_depth_m"));
    const core::Body &low = run.simulation.bodies()[0], &high = run.simulation.bodies()[1];
    EXPECT_LT(run.simulation.x()[low.firstNode].y(),
              run.simulation.x()[high.firstNode].y() - .18);  // m: none is through
    return deepest;
}

TEST(ContactSearch, SeeWhatIsStoppedOnItsWay)
{
    for (const char* height : {"0.42", "0.48"}) {  // m: cells of both meet, or lie apart
        const double deepest = deepestOfSlabs("[0, -6, 0]", height, "");
        EXPECT_GT(deepest, 0) << height;
        EXPECT_LT(deepest, .1 * kDx) << height;
    }
}

TEST(ContactSearch, SeeWhatIsThrown)
{
    for (const char* way : {"6", "12"}) {
        const double deepest = deepestOfSlabs(
            "[0, 0, 0]", "0.42",
            std::string("move = { keys = [{ time = 0 }, { time = 1, translate = [0, ") + way + ", 0] }] }\n");
        EXPECT_GT(deepest, 0) << way;
        EXPECT_LT(deepest, .1 * kDx) << way;
    }
}

/// A cube comes from farther than lists reach: it strikes the wall, and brings no energy.
TEST(ContactSearch, SeeWhatComesFromFar)
{
    constexpr double kSlow = 0.7;  // of the speed: what the wall has to take, at the least
    const auto body = [](const std::string& name, const std::string& box, const std::string& more) {
        return "[[body]]\nname = \"" + name + "\"\nmaterial = \"gel\"\nshape = { box = { size = " + box + " } }\n" +
               more;
    };
    for (const char* substeps : {"\"auto\"", "1"}) {
        lab::SceneRun run(
            "version = 1\nname = \"wall\"\n[time]\nframes = [1, 3]\nfps = 24\n[grid]\nvoxel_size = 0.02\n" +
                body("thrown", "[0.12, 0.12, 0.12], center = [-0.65, 0, 0]", "velocity = [20, 0, 0]\n") +
                body("wall", "[0.12, 0.4, 0.4]", "") +
                "[material.gel]\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\nfriction = 0\n",
            {std::string("time.substeps=") + substeps});
        const double start = run.simulation.totals().kineticEnergy;
        while (!run.atEnd()) EXPECT_LT(run.step().kineticEnergy, start * (1 + 1e-9)) << substeps;
        EXPECT_LT(run.steps.back().kineticEnergy, kSlow * start) << substeps;
        EXPECT_EQ(run.steps.back().outcome, core::Outcome::converged) << substeps;
    }
}

/// What falls as a whole comes no nearer to itself: it lists what it lists at rest, whatever others do.
TEST(ContactSearch, CommonMotionListsNothingMore)
{
    std::string scene = "version = 1\nname = \"rings\"\n[time]\nframes = [1, 2]\n[grid]\nvoxel_size = 0.05\n";
    for (const char* x : {"0", "9"})
        scene += std::string("[[body]]\nname = \"ring") + x +
                 "\"\nmaterial = \"gel\"\nshape = { torus = { radius = " + "0.4, tube = 0.15, center = [" + x +
                 ", 0, 0] } }\n";
    const lab::SceneRun run(scene +
                            "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\n");
    const auto bodies = run.simulation.bodies();
    const ContactParts parts(bodies, 2 * kDx);
    const contact::ContactSurface& surface = parts.surface;
    const contact::Targets& targets = parts.targets;
    const std::vector<Vec3> x(run.simulation.x().begin(), run.simulation.x().end());
    const auto pairs = [&](double speed, double common, double second = 0, double shear = 0) {
        std::vector<Vec3> v;
        for (const Vec3& X : x) {
            const bool isSecond = X.x() > 4;
            const Vec3 arm = X - Vec3(isSecond ? 9 : 0, 0, 0);
            v.push_back(Vec3(0, -common - isSecond * second, 0) + speed * Vec3(arm.y(), -arm.x(), 0) +
                        shear * Vec3(arm.y(), 0, 0));
        }
        contact::NarrowPhase near;
        const std::vector<Vec3> ahead = contact::RelativeMotion::ahead(x, v, .04, 8 * kDx).ends(),
                                own =
                                    contact::RelativeMotion::ahead(x, v, .04, 8 * kDx, surface.fragmentOfNode()).ends();
        near.find(surface, targets, {x, ahead}, {x, own}, .1 * kDx);
        return near.pairs();
    };
    const std::size_t atRest = pairs(0, 0), sheared = pairs(0, 0, 0, 20);
    EXPECT_GT(sheared, atRest);
    EXPECT_EQ(pairs(20, 0), atRest);
    EXPECT_EQ(pairs(0, 10), atRest);
    EXPECT_EQ(pairs(20, 8), atRest);
    EXPECT_EQ(pairs(0, 8, 10, 20), sheared);
    EXPECT_EQ(pairs(0, 0, 10), atRest);
    EXPECT_EQ(pairs(20, 8, 10), atRest);
}

/// However fast things fly apart, they are not looked for all along their ways.
/// A block with a slot, the arms beside which close. A list that lives on tells at each step what one that is made anew
/// does, also from when on there is something.
TEST(ContactSearch, ListsThatLiveOnTellWhatHasComeNear)
{
    constexpr double kMargin = .5 * kDx, kStep = .02 * kDx;
    const lab::SceneRun run(
        "version = 1\nname = \"slot\"\n[grid]\nvoxel_size = 0.05\n[[body]]\nname = \"arms\"\nmaterial = \"gel\"\n"
        "shape = { box = { size = [1, 1, 0.4] } }\ncut = [{ box = { size = [0.15, 0.9, 1], center = [0, 0.3, 0] } }]\n"
        "[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n[contact]\n");
    const auto bodies = run.simulation.bodies();
    const ContactParts parts(bodies, 2 * kDx);
    const contact::ContactSurface& surface = parts.surface;
    const contact::Targets& targets = parts.targets;
    const std::vector<Vec3> rest(run.simulation.x().begin(), run.simulation.x().end());
    contact::NarrowPhase lives;
    int searches = 0, without = 0, with = 0;
    for (int step = 0; step < 70; ++step) {
        std::vector<Vec3> x = rest;
        for (Vec3& p : x) p.x() -= std::copysign(std::max(0., p.y() + .5) * step * kStep, p.x());
        searches += lives.find(surface, targets, {x, x}, {x, x}, kMargin);
        contact::NarrowPhase anew;
        anew.find(surface, targets, {x, x}, {x, x}, kMargin);
        EXPECT_EQ(lives.pairs(), anew.pairs()) << step;
        ++(lives.pairs() > 0 ? with : without);
    }
    EXPECT_LT(searches, 10);
    EXPECT_GT(without, 5);
    EXPECT_GT(with, 5);
}

TEST(ContactSearch, WaysAreCutOff)
{
    constexpr double kFarthest = .4, kRounding = 1e-12;  // m
    const std::vector<Vec3> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(3, 0, 0)};
    const std::vector<Vec3> v = {Vec3(50, 50, 50), Vec3(-50, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)};
    std::vector<Vec3> to;
    for (std::size_t n = 0; n < x.size(); ++n) to.push_back(x[n] + .1 * v[n]);
    const auto gone = contact::RelativeMotion::gone(x, to, kFarthest);
    for (std::size_t n = 0; n < x.size(); ++n) EXPECT_LE(gone.ways()[n].norm(), kFarthest + kRounding) << n;
    const std::vector<Vec3> ahead = contact::RelativeMotion::ahead(x, v, .1, kFarthest).ends();
    EXPECT_LE(gone.farthestBeside({x, ahead}), kRounding);  // they went where they were expected
}

}  // namespace
