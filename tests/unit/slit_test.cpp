// Narrow slits of meshes: every voxel has the sign of the solid, and gaps that no voxel lies in are counted.
#include "openvdb_access.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/vdb_file.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

using namespace vdbfrac;
using namespace vdbfrac::grid;
using tetmesh::PolygonSoup;
namespace fs = std::filesystem;

namespace {

constexpr double kDx = 0.05;
/// Of a voxel: the mesh is written with 17 digits, distances are floats.
constexpr double kRounding = 1e-5;
constexpr std::uint64_t kPlenty = std::uint64_t{4} << 30;  // bytes

/// A block with a slit across the middle of its top, through its whole width, turned and moved. Lengths in m.
struct SlitBlock {
    double width = 0, depth = 0.6;
    Mat3 turn = Mat3::Identity();
    Vec3 at = Vec3(0.013, -0.021, 0.034);
    Vec3 size = Vec3(1, 1, 0.7);

    /// Positive outside. Its zero and sign are exact; it is the distance but at edges.
    double phi(const Vec3& X) const
    {
        const Vec3 local = turn.transpose() * (X - at);
        Primitive block, slit;
        block.size = size;
        slit.center.y() = 0.5 * size.y() - 0.5 * depth + 0.5;
        slit.size = Vec3(width, depth + 1, size.z() + 1);
        return std::max(signedDistance(block, local), -signedDistance(slit, local));
    }

    PolygonSoup mesh() const
    {
        const double x = 0.5 * size.x(), y = 0.5 * size.y(), z = 0.5 * size.z(), a = 0.5 * width, c = y - depth;
        // The outline, and the cap as convex parts of it.
        const std::array<std::array<double, 2>, 10> outline{{{-x, -y}, {x, -y}, {x, c}, {x, y}, {a, y}, {a, c}, {-a, c}, {-a, y}, {-x, y}, {-x, c}}};
        const std::vector<std::vector<std::size_t>> caps = {{0, 1, 2, 5, 6, 9}, {2, 3, 4, 5}, {9, 6, 7, 8}};
        const std::size_t n = outline.size();
        PolygonSoup soup;
        for (double height : {-z, z})
            for (const auto& p : outline) soup.points.push_back(at + turn * Vec3(p[0], p[1], height));
        for (const auto& cap : caps) {
            soup.polygons.emplace_back(cap.rbegin(), cap.rend());
            soup.polygons.push_back(cap);
            for (std::size_t& corner : soup.polygons.back()) corner += n;
        }
        for (std::size_t i = 0; i < n; ++i) soup.polygons.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
        return soup;
    }
};

/// Turns about axes that follow no symmetry of the lattice, but for the first.
std::vector<Mat3> turns()
{
    std::vector<Mat3> all{Mat3::Identity()};
    for (const auto& [angle, axis] : {std::pair{0.3, Vec3(0, 0, 1)}, {0.7854, Vec3(0, 0, 1)}, {0.9553, Vec3(1, -1, 0)}, {1.1, Vec3(0.3, 0.5, 0.8)}})
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
        std::string text;
        char line[120];
        for (const Vec3& p : soup.points) {
            std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", p.x(), p.y(), p.z());
            text += line;
        }
        for (const auto& polygon : soup.polygons) {
            text += "f";
            for (std::size_t c : polygon) text += " " + std::to_string(c + 1);
            text += "\n";
        }
        writeText(folder_ / "mesh.obj", text);
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
    forVoxels(block, [&](const openvdb::Coord& c, double exact) { wrong += std::abs(exact) > kRounding && (values.getValue(c) < 0) != (exact < 0); });
    return wrong;
}

/// The block's phi as a .vdb.
fs::path writeExact(const SlitBlock& block, const fs::path& file)
{
    auto grid = makeLevelSetGrid(kDx, 3);
    forVoxels(block, [&](const openvdb::Coord& c, double exact) {
        std::abs(exact) < 3 ? grid->tree().setValue(c, float(exact * kDx)) : grid->tree().setValueOff(c, std::copysign(grid->background(), float(exact)));
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

}  // namespace
