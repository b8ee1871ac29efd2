// What is drawn of pieces that are in each other.
#include "drawn_surface.h"

#include <vdbfrac/core/drawing.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/solids/solid_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

using namespace vdbfrac;
using lab::SceneRun;
using test::Drawn;
using test::fallingBall;
using test::kDx;

namespace {

constexpr double kExact = 1e-12;

/// What flies at the ball from below.
constexpr const char* kOther =
    "[[body]]\nname = \"other\"\nshape = { sphere = { radius = 0.3, center = [0.02, -0.3, 0.01] } }\n"
    "velocity = [0, 2, 0]\nmaterial = \"jelly\"\n";

/// A box of triangles `edge` [voxels] long, turned [degrees], added to a surface as a fragment of its own.
void addBox(const Vec3& center, const Vec3& size, double edge, tetmesh::Surface& surface, double aboutZ = 0)
{
    const auto box = solids::solidMesh(
        {.kind = Primitive::Kind::box, .center = center, .size = size, .rotate = Vec3(0, 0, aboutZ)}, {}, edge * kDx);
    ASSERT_TRUE(box);
    const tetmesh::Surface own = test::surfaceOf(*box, surface.fragment.empty() ? 0 : surface.fragment.back() + 1);
    for (auto t : own.triangles) {
        for (std::uint32_t& p : t) p += std::uint32_t(surface.points.size());
        surface.triangles.push_back(t);
    }
    surface.points.insert(surface.points.end(), own.points.begin(), own.points.end());
    surface.fragment.insert(surface.fragment.end(), own.fragment.begin(), own.fragment.end());
    surface.torn.insert(surface.torn.end(), own.torn.begin(), own.torn.end());
}

SceneRun touching(const std::string& more) { return SceneRun(fallingBall("[contact]\n" + more)); }

/// Two boxes, one on the other, `depth` [voxels] in each other, of triangles as long as `lower` and `upper`.
struct Stacked {
    tetmesh::Surface surface;
    std::size_t first = 0;  // point of the upper one

    Stacked(double depth, double lower, double upper)
    {
        addBox(Vec3(0, -.5, 0), Vec3(1, 1, 1), lower, surface);
        first = surface.points.size();
        addBox(Vec3(.03, .3 - depth * kDx, .02), Vec3(.6, .6, .6), upper, surface);
    }
};

/// Both go half of the way where both have points; where one has none, the other goes all of it.
TEST(DrawnPieces, AreDrawnApartWhereAskedFor)
{
    constexpr double kDepth = 1.4, kOff = .05;  // voxels
    const SceneRun run = touching("drawn = \"apart\"\n");
    const auto ends = [&](double lower, double upper) {
        const Stacked stacked(kDepth, lower, upper);
        Drawn drawn(stacked.surface);
        drawn.place(run, 0);
        double top = -1, bottom = 1;  // below the middle of the upper box
        for (std::size_t p = 0; p < drawn.points.size(); ++p) {
            const Vec3 &was = stacked.surface.points[p], &is = drawn.points[p];
            EXPECT_EQ(drawn.isMoved[p] != 0, is != was) << p;
            if (std::max(std::abs(was.x()), std::abs(was.z())) > .16) continue;  // a side is nearer
            EXPECT_LT(std::hypot(is.x() - was.x(), is.z() - was.z()), kExact) << p;
            if (p < stacked.first && was.y() > -.1) top = std::max(top, is.y() / kDx);
            if (p >= stacked.first && was.y() < .1) bottom = std::min(bottom, is.y() / kDx);
        }
        return std::pair(top, bottom);
    };
    const auto [top, bottom] = ends(2, 2);
    EXPECT_NEAR(top, -kDepth / 2, kOff);
    EXPECT_NEAR(bottom, -kDepth / 2, kOff);
    EXPECT_NEAR(ends(1000, 2).second, 0, kOff);
    EXPECT_NEAR(ends(2, 1000).first, -kDepth / 2, kOff);  // the upper one's corners are in the lower one
}

/// What lies on each other like closed lips, what has passed through, and what a piece that is inside out would push,
/// stays where it is.
TEST(DrawnPieces, StayWhereTheyOnlyTouch)
{
    const SceneRun run = touching("drawn = \"apart\"\n");
    const auto moved = [&](const tetmesh::Surface& surface) {
        Drawn drawn(surface);
        drawn.place(run, 0);
        EXPECT_EQ(drawn.points == surface.points, std::ranges::count(drawn.isMoved, 1) == 0);
        return std::ranges::count(drawn.isMoved, 1);
    };
    EXPECT_EQ(moved(Stacked(0, 2, 2).surface), 0);
    EXPECT_EQ(moved(Stacked(.009, 2, 2).surface), 0);
    EXPECT_EQ(moved(Stacked(-.5, 2, 2).surface), 0);
    EXPECT_GT(moved(Stacked(1, 2, 2).surface), 20);
    // Three voxels and more from any face of the other one.
    tetmesh::Surface inside;
    addBox(Vec3::Zero(), Vec3(1, 1, 1), 2, inside);
    addBox(Vec3::Zero(), Vec3(.6, .6, .6), 2, inside);
    EXPECT_EQ(moved(inside), 0);
    // The far side of a plate is two voxels above the side of a box that stands on an edge: to one that is inside out
    // that is within, and the way out leads back into the plate.
    tetmesh::Surface beside;
    addBox(Vec3(0, -.5, 0), Vec3(1, 1, 1), 1000, beside, 45);
    const std::size_t turned = beside.triangles.size();
    const Vec3 out = Vec3(1, 1, 0).normalized();
    addBox(Vec3(0, -.5, 0) + (.5 + 1.5 * kDx) * out, Vec3(3, kDx, 3), 2, beside, -45);
    EXPECT_EQ(moved(beside), 0);
    for (std::size_t t = 0; t < turned; ++t) std::swap(beside.triangles[t][0], beside.triangles[t][1]);
    EXPECT_EQ(moved(beside), 0);
}

/// A plate a voxel thick that sinks into a box: points of the box that come to its middle do not jump to its other
/// side, and are not drawn far out of the box to where that is nearer.
TEST(DrawnPieces, AreNotThrownThroughThinOnes)
{
    const SceneRun run = touching("drawn = \"apart\"\n");
    // How far the top of the box is moved in the middle, the middle of the plate `above` it [voxels].
    const auto moved = [&](double above, double thick = 1) {
        tetmesh::Surface plate;
        addBox(Vec3(0, -.5, 0), Vec3(1, 1, 1), 2, plate);
        const std::size_t ofBox = plate.points.size();
        addBox(Vec3(0, above * kDx, 0), Vec3(.6, thick * kDx, .6), 2, plate);
        Drawn drawn(plate);
        drawn.place(run, 0);
        for (std::size_t p = 0; p < ofBox; ++p)
            if (plate.points[p].norm() < .03) return (drawn.points[p].y() - plate.points[p].y()) / kDx;
        return 9.;
    };
    double before = moved(.6);
    EXPECT_EQ(before, 0);
    for (double above = .59; above > -.6; above -= .01) {
        const double now = moved(above);
        EXPECT_LT(std::abs(now - before), .05) << above;
        before = now;
    }
    EXPECT_LT(moved(.35), -.05);
    EXPECT_GT(moved(-.35), .05);
    // From farther than a voxel none is drawn out of the box.
    EXPECT_LT(moved(.8, 4), -.3);
    EXPECT_EQ(moved(-.8, 4), 0);
}

/// A crumb that sinks into a body is drawn beside it less and less, and stays where it is when most of it is in there.
TEST(DrawnPieces, StayWhereACrumbLiesInABody)
{
    const SceneRun run = touching("drawn = \"apart\"\n");
    const auto most = [&](double above) {
        tetmesh::Surface surface;
        addBox(Vec3(0, -.5, 0), Vec3(1, 1, 1), 2, surface);
        addBox(Vec3(.013, above * kDx, .017), 3 * kDx * Vec3::Ones(), .5, surface);
        Drawn drawn(surface);
        drawn.place(run, 0);
        double far = 0;
        for (std::size_t p = 0; p < drawn.points.size(); ++p)
            far = std::max(far, (drawn.points[p] - surface.points[p]).norm() / kDx);
        return far;
    };
    EXPECT_GT(most(1.2), .1);
    EXPECT_GT(most(.5), .5);
    EXPECT_LT(most(-1.2), .2);
    EXPECT_LT(most(-1.6), .05);
}

/// Between two voxels, where all of the overlap goes, and three, where all of it stays, some of it does.
TEST(DrawnPieces, AreDrawnApartLessWhereTheyAreDeep)
{
    constexpr double kOff = .05;  // voxels
    const SceneRun run = touching("drawn = \"apart\"\n");
    const auto overlap = [&](double depth, double lower, double upper) {
        const Stacked stacked(depth, lower, upper);
        Drawn drawn(stacked.surface);
        drawn.place(run, 0);
        double top = -1, bottom = 1;
        for (std::size_t p = 0; p < drawn.points.size(); ++p) {
            const Vec3 &was = stacked.surface.points[p], &is = drawn.points[p];
            if (std::max(std::abs(was.x()), std::abs(was.z())) > .1) continue;  // a side is nearer
            if (p < stacked.first && was.y() > -.01) top = std::max(top, is.y());
            if (p >= stacked.first && was.y() < .1) bottom = std::min(bottom, is.y());
        }
        return (top - bottom) / kDx;
    };
    for (const double depth : {1.9, 2.2, 2.5, 2.8, 3.1}) {
        const double left = depth * std::clamp(depth - 2, 0., 1.);
        EXPECT_NEAR(overlap(depth, 1.5, 1.5), left, kOff) << depth;
    }
}

/// Bodies that are pressed on each other: what is simulated does not know how they are drawn.
TEST(DrawnPieces, OfBodiesThatArePressedAreApart)
{
    const auto pressed = [](const std::string& drawn) {
        return fallingBall(kOther + ("[contact]\nstiffness = 1\n" + drawn));
    };
    SceneRun run(pressed("drawn = \"apart\"\n")), raw(pressed(""));
    run.toFrame(4), raw.toFrame(4);
    ASSERT_EQ(run.simulation.stateHash(), raw.simulation.stateHash());
    EXPECT_TRUE(raw.simulation.stages().draw.empty());
    core::Drawing drawing(run.scene, run.simulation), asSimulated(raw.scene, raw.simulation);
    drawing.follow(run.simulation, run.work), asSimulated.follow(raw.simulation, raw.work);
    const core::DrawnFrame apart = drawing.frame(run.simulation), all = asSimulated.frame(raw.simulation);
    // Voxels that points still have to go.
    const auto left = [&](core::DrawnFrame frame) {
        double most = 0;
        std::vector<Drawn> drawn;
        for (const core::DrawnBody& body : frame) drawn.emplace_back(body.points).topology = *body.topology;
        std::vector<core::DrawnSurface> all;
        for (Drawn& d : drawn) all.push_back({d.topology, d.used, d.points, d.velocity, d.isMoved});
        run.simulation.stages().draw.at(0)->place(0, all);
        for (std::size_t b = 0; b < frame.size(); ++b)
            for (std::size_t p = 0; p < frame[b].points.size(); ++p)
                most = std::max(most, (drawn[b].points[p] - frame[b].points[p]).norm() / kDx);
        return most;
    };
    EXPECT_GT(left(all), .3);
    EXPECT_LT(left(apart), .1);
    EXPECT_GT(apart[0].moved + apart[1].moved, 5);
}

}  // namespace
