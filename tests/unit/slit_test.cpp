// Narrow slits of meshes: every voxel has the sign of the solid, and gaps that no voxel lies in are counted.
#include "openvdb_access.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/samples/slit_block.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

using namespace vdbfrac;
using namespace vdbfrac::grid;
using lab::objText;
using lab::SlitBlock;
using tetmesh::PolygonSoup;
namespace fs = std::filesystem;

namespace {

constexpr double kDx = 0.05;
/// Of a voxel: the mesh is written with 17 digits, distances are floats.
constexpr double kRounding = 1e-5;
constexpr std::uint64_t kPlenty = std::uint64_t{4} << 30;  // bytes
/// Of voxels: farther off an edge, meshToVolume takes a triangle that is near the closest one.
constexpr double kBand = 2.4;

/// Turns about axes that follow no symmetry of the lattice, but for the first.
std::vector<Mat3> turns()
{
    std::vector<Mat3> all{Mat3::Identity()};
    for (const auto& [angle, axis] :
         {std::pair{0.3, Vec3(0, 0, 1)}, {0.7854, Vec3(0, 0, 1)}, {0.9553, Vec3(1, -1, 0)}, {1.1, Vec3(0.3, 0.5, 0.8)}})
        all.push_back(Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix());
    return all;
}

class Slits : public testing::Test {
protected:
    void SetUp() override
    {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() / ("vdbfrac-" + std::to_string(::getpid()) + "-" + info->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    scene::Body bodyOf(const PolygonSoup& soup) const
    {
        writeText(folder_ / "mesh.obj", objText(soup));
        scene::Body body;
        body.name = "slit";
        body.shape = scene::MeshFile{folder_ / "mesh.obj"};
        return body;
    }

    fs::path folder_;
};

LevelSet make(const scene::Body& body, std::vector<std::string>* notes = nullptr)
{
    scene::Grid grid;
    grid.voxelSize = kDx;
    return makeLevelSet(body, grid, kPlenty, notes);
}

/// Calls visit(voxel, distance in voxels) for all voxels of a box round the block.
template <class Visit>
void forVoxels(const SlitBlock& block, const Visit& visit)
{
    const int n = int(std::ceil(0.5 * block.size.norm() / kDx)) + 4;
    for (auto ijk = openvdb::CoordBBox(openvdb::Coord(-n), openvdb::Coord(n)).begin(); ijk; ++ijk)
        visit(*ijk, block.phi(kDx * Vec3((*ijk).x(), (*ijk).y(), (*ijk).z())) / kDx);
}

int wrongSigns(const LevelSet& phi, const SlitBlock& block)
{
    int wrong = 0;
    const auto values = phi.grid().grid->getConstAccessor();
    forVoxels(block, [&](const openvdb::Coord& c, double exact) {
        wrong += std::abs(exact) > kRounding && (values.getValue(c) < 0) != (exact < 0);
    });
    return wrong;
}

/// The block's phi as a .vdb.
fs::path writeExact(const SlitBlock& block, const fs::path& file)
{
    auto grid = makeLevelSetGrid(kDx, 3);
    forVoxels(block, [&](const openvdb::Coord& c, double exact) {
        std::abs(exact) < 3 ? grid->tree().setValue(c, float(exact * kDx))
                            : grid->tree().setValueOff(c, std::copysign(grid->background(), float(exact)));
    });
    const LevelSet phi = wrap(grid);
    writeVdb(file, {{"phi", &phi, {}, 1, "m"}}, {});
    return file;
}

TEST_F(Slits, MeshesHaveTheSignsOfTheSolidAtEveryVoxel)
{
    for (double width : {1., 1.5, 2., 3., 4.})
        for (std::size_t t = 0; t < turns().size(); ++t) {
            SlitBlock block;
            block.width = width * kDx;
            block.turn = turns()[t];
            std::vector<std::string> notes;
            const LevelSet fromMesh = make(bodyOf(block.mesh()), &notes);
            EXPECT_EQ(wrongSigns(fromMesh, block), 0) << width << " voxels, turn " << t;
            EXPECT_TRUE(notes.empty()) << notes[0];
            scene::Body exact;
            exact.name = "exact";
            exact.shape = scene::VdbFile{writeExact(block, folder_ / "exact.vdb"), ""};
            EXPECT_EQ(wrongSigns(make(exact), block), 0) << width << " voxels, turn " << t;
        }
}

TEST_F(Slits, AnyTurnAndOffsetOfASlitWiderThanAVoxelIsOpen)
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 30; ++i) {
        SlitBlock block;
        block.width = (1.5 + 0.5 * uniform(random)) * kDx;
        block.turn = Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random))
                         .normalized()
                         .toRotationMatrix();
        block.at = kDx * Vec3(uniform(random), uniform(random), uniform(random));
        EXPECT_EQ(wrongSigns(make(bodyOf(block.mesh())), block), 0) << "block " << i;
    }
}

TEST_F(Slits, WindingAndUnweldedPointsDoNotMatter)
{
    SlitBlock block;
    block.width = 1.2 * kDx;
    block.turn = turns()[4];
    PolygonSoup inward = block.mesh(), mixed = block.mesh(), loose;
    for (auto& polygon : inward.polygons) std::reverse(polygon.begin(), polygon.end());
    for (std::size_t i = 0; i < mixed.polygons.size(); i += 2)
        std::reverse(mixed.polygons[i].begin(), mixed.polygons[i].end());
    for (auto polygon : block.mesh().polygons) {
        for (std::size_t& corner : polygon) {
            loose.points.push_back(block.mesh().points[corner]);
            corner = loose.points.size() - 1;
        }
        loose.polygons.push_back(polygon);
    }
    for (const PolygonSoup& soup : {inward, mixed, loose}) EXPECT_EQ(wrongSigns(make(bodyOf(soup)), block), 0);
}

TEST_F(Slits, FacesThatAreThereTwiceAndFacesWithoutAreaDoNotMatter)
{
    SlitBlock block;
    block.width = 1.2 * kDx;
    block.turn = turns()[4];
    PolygonSoup doubled = block.mesh(), flat = block.mesh();
    doubled.polygons.insert(doubled.polygons.end(), flat.polygons.begin(), flat.polygons.end());
    const Vec3 middle =
        0.5 * (flat.points[4] + flat.points[14]);  // on an edge of the slit: a T-junction, closed by a flat triangle
    flat.points.push_back(middle);
    for (auto& polygon : flat.polygons)
        if (polygon == std::vector<std::size_t>{4, 5, 15, 14}) polygon = {4, 5, 15, 14, 20};
    flat.polygons.push_back({4, 20, 14});
    ASSERT_TRUE(tetmesh::examine(flat).closed);
    for (const PolygonSoup& soup : {doubled, flat}) EXPECT_EQ(wrongSigns(make(bodyOf(soup)), block), 0);
}

TEST_F(Slits, SameBitsForAnyNumberOfThreads)
{
    SlitBlock block;
    block.width = 1.3 * kDx;
    block.turn = turns()[4];
    const scene::Body body = bodyOf(block.mesh());
    const LevelSet many = make(body);
    for (int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        const LevelSet few = make(body);
        EXPECT_EQ(many.activeVoxels(), few.activeVoxels());
        const auto values = few.grid().grid->getConstAccessor();
        for (auto v = many.grid().grid->cbeginValueAll(); v; ++v) ASSERT_EQ(*v, values.getValue(v.getCoord()));
    }
}

PolygonSoup box(const Vec3& lower, const Vec3& upper)
{
    PolygonSoup soup;
    for (int i = 0; i < 8; ++i)
        soup.points.emplace_back(i & 1 ? upper.x() : lower.x(), i >> 1 & 1 ? upper.y() : lower.y(),
                                 i >> 2 ? upper.z() : lower.z());
    soup.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    return soup;
}

PolygonSoup both(PolygonSoup a, const PolygonSoup& b, bool turned = false)
{
    for (auto polygon : b.polygons) {
        for (std::size_t& corner : polygon) corner += a.points.size();
        if (turned) std::reverse(polygon.begin(), polygon.end());
        a.polygons.push_back(polygon);
    }
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    return a;
}

double boxPhi(const Vec3& lower, const Vec3& upper, const Vec3& X)
{
    Primitive p;
    p.center = 0.5 * (lower + upper);
    p.size = upper - lower;
    return signedDistance(p, X);
}

/// Voxels within `within` voxels of the surface that do not hold `exact`, to a hundredth of a voxel.
template <class Exact>
int wrongValues(const LevelSet& phi, double within, const Exact& exact)
{
    int wrong = 0;
    const auto values = phi.grid().grid->getConstAccessor();
    for (auto ijk = openvdb::CoordBBox(openvdb::Coord(-30), openvdb::Coord(50)).begin(); ijk; ++ijk) {
        const double d = exact(kDx * Vec3((*ijk).x(), (*ijk).y(), (*ijk).z()));
        wrong += std::abs(d) < within * kDx ? std::abs(values.getValue(*ijk) - d) > 0.01 * kDx
                                            : (values.getValue(*ijk) < 0) != (d < 0);
    }
    return wrong;
}

TEST_F(Slits, ShellsThatOverlapAreOneSolid)
{
    const Vec3 a(-0.513, -0.507, -0.511), b(0.521, 0.533, 0.527), c(0.113, 0.127, 0.139), d(1.117, 1.109, 1.121);
    for (bool turned : {false, true}) {
        std::vector<std::string> notes;
        const LevelSet phi = make(bodyOf(both(box(a, b), box(c, d), turned)), &notes);
        // What is in both shells is nearest to the ring where they meet, which the least of both distances does not
        // know.
        EXPECT_EQ(wrongValues(phi, 0.5,
                              [&](const Vec3& X) {
                                  const double first = boxPhi(a, b, X), second = boxPhi(c, d, X);
                                  return first < 0 && second < 0 ? -1 : std::min(first, second);
                              }),
                  0);
        EXPECT_TRUE(notes.empty());
    }
}

TEST_F(Slits, ClosedHollowsAreFilledAndTheirSurfaceIsForgotten)
{
    const Vec3 a(-0.513, -0.507, -0.511), b(0.521, 0.533, 0.527);
    for (const Vec3& half : {Vec3(0.2, 0.2, 0.2), Vec3(0.2, 0.2, 0.4 * kDx)})  // the second holds hardly a voxel
        for (bool turned : {false, true}) {
            std::vector<std::string> notes;
            const LevelSet phi = make(bodyOf(both(box(a, b), box(-half, half), turned)), &notes);
            EXPECT_EQ(wrongValues(phi, kBand, [&](const Vec3& X) { return boxPhi(a, b, X); }), 0);
            EXPECT_TRUE(notes.empty()) << "a hollow is no gap: " << notes[0];
        }
}

/// The surface of a shell inside another is forgotten wherever it lies in the blocks of voxels.
TEST_F(Slits, ThinShellsInsideOthersLeaveNoSurface)
{
    const Vec3 corner = Vec3::Constant(16.1 * kDx);
    for (const auto& [lower, upper] : {std::pair{Vec3(1.05, 2.05, 3.05), Vec3(7.45, 3.95, 3.95)},
                                       {Vec3(4.55, 2.05, 3.05), Vec3(7.45, 3.95, 3.95)},
                                       {Vec3(1.05, 2.05, 2.05), Vec3(7.45, 5.05, 5.05)},
                                       {Vec3(-7.3, -0.4, 0.3), Vec3(-1.2, 0.6, 6.7)}}) {
        const LevelSet phi = make(bodyOf(both(box(-corner, corner), box(kDx * lower, kDx * upper))));
        const auto values = phi.grid().grid->getConstAccessor();
        int shallow = 0;
        for (auto ijk = openvdb::CoordBBox(openvdb::Coord(-12), openvdb::Coord(12)).begin(); ijk; ++ijk)
            shallow += values.getValue(*ijk) > -2.9 * kDx;
        EXPECT_EQ(shallow, 0) << lower.transpose();
    }
}

TEST_F(Slits, ShellsTurnedInsideOutInPartAreFilled)
{
    // A prism whose top is mirrored: above the line where its sides cross, its faces look inward.
    PolygonSoup soup = box(Vec3(-0.51, -0.52, -0.53), Vec3(0.51, 0.52, 0.53));
    constexpr double kTop = -0.6;
    for (std::size_t i = 4; i < 8; ++i) soup.points[i].x() *= kTop;
    const double crossing = -0.53 + 1.06 / (1 - kTop);
    soup.points.emplace_back(0, -0.52, crossing);
    soup.points.emplace_back(0, 0.52, crossing);
    soup.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 8},          {8, 5, 4},
                     {2, 9, 3},    {9, 6, 7},    {0, 8, 4, 6, 9, 2}, {1, 3, 9, 7, 5, 8}};
    ASSERT_TRUE(tetmesh::examine(soup).oriented);
    const Mat3 turn = turns()[4];
    for (Vec3& X : soup.points) X = turn * X;
    std::vector<std::string> notes;
    const LevelSet phi = make(bodyOf(soup), &notes);
    int wrong = 0;
    const auto values = phi.grid().grid->getConstAccessor();
    for (auto ijk = openvdb::CoordBBox(openvdb::Coord(-22), openvdb::Coord(22)).begin(); ijk; ++ijk) {
        const Vec3 X = turn.transpose() * (kDx * Vec3((*ijk).x(), (*ijk).y(), (*ijk).z()));
        const double side = 0.51 * std::abs(1 + (kTop - 1) * (X.z() + 0.53) / 1.06);
        wrong +=
            (values.getValue(*ijk) < 0) != (std::abs(X.x()) < side && std::abs(X.y()) < 0.52 && std::abs(X.z()) < 0.53);
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_TRUE(notes.empty());
}

TEST_F(Slits, GapsThatTheGridCannotHoldAreCounted)
{
    SlitBlock block;
    block.width = 0.4 * kDx;
    block.at = Vec3(0.5 * kDx, 0, 0);  // between two layers of voxels
    std::vector<std::string> notes;
    make(bodyOf(block.mesh()), &notes);
    ASSERT_EQ(notes.size(), 1u);
    // One pair for each voxel of the slit's depth and width, but at its rim, where there is outside beside it.
    const double whole = block.depth / kDx * block.size.z() / kDx;
    const double counted = std::stod(notes[0].substr(notes[0].find(':') + 1));
    EXPECT_GT(counted, 0.6 * whole) << notes[0];
    EXPECT_LE(counted, whole + 1) << notes[0];
    EXPECT_NE(notes[0].find("0.05 m"), std::string::npos) << notes[0];

    PolygonSoup soup = block.mesh();
    Band band;
    band.voxelSize = kDx;
    std::int64_t gaps = 0;
    surfaceLevelSet({soup, tetmesh::examine(soup), 0, "test"}, band, &gaps);
    EXPECT_EQ(double(gaps), counted);
    block.width = 0;
    const Vec3 a(-0.5, -0.5, -0.5), c(0.55, -0.5, -0.5), d(1.5, 0.5, 0.5);
    soup = both(box(a, Vec3(0.52, 0.5, 0.5)), box(c, d));  // two boxes a gap apart that has no voxel in it
    band.voxelSize = 0.1;
    surfaceLevelSet({soup, tetmesh::examine(soup), 0, "test"}, band, &gaps);
    EXPECT_GT(gaps, 50);
    soup = both(box(a, Vec3(0.57, 0.5, 0.5)), box(c, d));  // two that overlap by as much
    surfaceLevelSet({soup, tetmesh::examine(soup), 0, "test"}, band, &gaps);
    EXPECT_EQ(gaps, 0);
}

}  // namespace
