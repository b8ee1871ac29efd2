// Lips that touch again are drawn on each other.
#include "lattices.h"
#include "voxel_box.h"

#include <vdbfrac/skin/opposite.h>
#include <vdbfrac/skin/skin.h>
#include <vdbfrac/tetmesh/fragments.h>
#include <vdbfrac/tetmesh/nodes_where.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>

using namespace vdbfrac;
using test::voxelBox;
using tetmesh::CutMesh;

namespace {

/// A box that a crack has gone through. Its sides go towards each other, the gap between them closes, and carry their
/// lips past each other.
class PressedLips : public test::Lattices {
protected:
    static constexpr double kWaves = .1;  // voxels: of what lips are off a plane
    const Vec3 n_ = Vec3(1, .3, 0).normalized(), along_ = Vec3(-.3, 1, 0).normalized();

    struct Seen {
        std::vector<Vec3> carried, points, velocity;
    };
    double depth(const Vec3& p) const { return n_.dot(p) - .019; }
    void SetUp() override
    {
        const Coord half{6, 6, 3};
        body_.emplace(GetParam(),
                      lab::sample({-10, -10, -10}, {10, 10, 10}, dx, test::boxAt(Vec3::Zero(), dx * half.toVec())));
        skin_.emplace(voxelBox(half, dx), *body_, skin::CrackStyle{});
        const auto crack = [&](const Vec3& p) { return dx - std::abs(depth(p)); };
        body_->update(test::raised(*body_, {-9, -9, -9}, {9, 9, 9}, crack));
        std::uint32_t nextId = 0;
        fragments_.emplace(*body_, nextId);
        ASSERT_EQ(fragments_->fragments().size(), 2u);
        skin_->follow(*body_, fragments_->ofNode());
    }
    /// Each side by so many voxels towards the other, and slid along it.
    Seen pressed(double by) const
    {
        std::vector<Vec3> x = tetmesh::restPositions(*body_), v(x.size());
        std::array<double, 2> side{};
        for (std::size_t i = 0; i < x.size(); ++i) side[fragments_->ofNode()[i]] += depth(x[i]);
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double s = side[fragments_->ofNode()[i]] < 0 ? -1 : 1;
            x[i] += s * dx * (.15 * along_ - by * n_), v[i] = -s * n_;
        }
        Seen seen{skin_->carried(x), skin_->carried(x), skin_->carried(v)};
        skin_->partLips(seen.points, seen.velocity);
        return seen;
    }
    const tetmesh::DrawnTopology& drawn() const { return *skin_->topology(); }

private:
    std::optional<CutMesh> body_;
    std::optional<skin::Skin> skin_;
    std::optional<tetmesh::FragmentTracker> fragments_;
};
INSTANTIATE_TEST_SUITE_P(All, PressedLips, test::kLattices, test::nameOfLattice);

TEST_P(PressedLips, StayWhereTheyAreOpenOrFarPastEachOther)
{
    for (const double by : {-.5, 0., 1.7}) {  // open, just closed, and so far past each other that they are others
        const Seen seen = pressed(by);
        for (std::size_t p = 0; p < seen.points.size(); ++p)
            EXPECT_LE((seen.points[p] - seen.carried[p]).norm(), (by < 0 ? 0 : kWaves) * dx) << by;
    }
}

TEST_P(PressedLips, AreDrawnOnEachOther)
{
    constexpr double kBy = .4, kMet = .05;  // voxels
    constexpr double kTogether = .2;        // of the velocity at which the sides meet
    const Seen seen = pressed(kBy);
    const skin::ClosedLips lips = skin::closedLips(drawn(), dx);
    std::vector<double> before, after, together;  // m, m, m/s
    for (const auto* some : {&lips.faces, &lips.rims})
        for (const skin::Opposite& lip : *some) {
            const auto apart = [&](const std::vector<Vec3>& at) { return n_.dot(lip.at(at) - at[lip.point]); };
            before.push_back(std::abs(std::abs(apart(seen.carried)) - 2 * kBy * dx));
            after.push_back(std::abs(apart(seen.points)));
            together.push_back(std::abs(n_.dot(seen.velocity[lip.point])));
        }
    EXPECT_GT(before.size(), 100u);
    for (std::vector<double>* some : {&before, &after, &together}) {
        std::ranges::sort(*some);
        EXPECT_LT((*some)[some->size() * 95 / 100], some == &together ? kTogether : kMet * dx);
    }
}

TEST_P(PressedLips, TakeTheSkinAlongThatIsNear)
{
    constexpr double kBy = .4, kBeside = 2;  // voxels
    const Seen seen = pressed(kBy);
    std::set<std::uint32_t> lips, near;
    for (std::size_t f = 0; f < drawn().mesh.faces(); ++f)
        for (const auto& corner : drawn().mesh.face(f)) {
            const bool isNear = std::abs(depth(drawn().mesh.points[corner.point])) < dx;
            if (drawn().torn[f])
                lips.insert(corner.point);
            else if (isNear)
                near.insert(corner.point);
        }
    double moved = 0;  // of what lips go
    std::size_t count = 0;
    for (const std::uint32_t p : near)
        if (!lips.contains(p)) moved += (seen.points[p] - seen.carried[p]).norm() / (kBy * dx), ++count;
    EXPECT_GT(count, 20u);
    EXPECT_GT(moved / double(count), .2);  // most are nearly a voxel away, and go less than half
    EXPECT_LT(moved / double(count), 1);
    std::size_t far = 0;
    for (std::size_t f = 0; f < drawn().mesh.faces(); ++f) {
        const auto c = drawn().mesh.face(f);
        for (const auto& corner : c) {
            const double moved = (seen.points[corner.point] - seen.carried[corner.point]).norm();
            EXPECT_LE(moved, (kBy + kWaves) * dx);
            if (std::abs(depth(drawn().mesh.points[corner.point])) < (kBeside + kWaves) * dx) continue;
            EXPECT_EQ(moved, 0);
            ++far;
        }
        const auto area = [&](const std::vector<Vec3>& at) {
            return Vec3((at[c[1].point] - at[c[0].point]).cross(at[c[2].point] - at[c[0].point]));
        };
        EXPECT_TRUE(drawn().torn[f] || area(seen.points).dot(area(drawn().mesh.points)) >= 0) << "folded: face " << f;
    }
    EXPECT_GT(far, 100u);
}

}  // namespace
