// Files of tets and surfaces: what is refused, and what our own reader finds in surfaces again.
// (tests/python/check_mesh_files.py reads every format with another program.)
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/surface_file.h>
#include <vdbfrac/tetmesh/surface_input.h>
#include <vdbfrac/tetmesh/tet_file.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

using namespace vdbfrac;
using tetmesh::TetFormat;

namespace {

tetmesh::TetMesh twoTets()
{
    tetmesh::TetMesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1. / 3, -1, .1}};
    mesh.tets = {{0, 1, 2, 3}, {0, 4, 1, 3}};
    mesh.boundary = tetmesh::boundaryOf(mesh.tets);
    return mesh;
}

tetmesh::Surface shell()
{
    const tetmesh::TetMesh mesh = twoTets();
    tetmesh::Surface surface;
    surface.points = mesh.points;
    surface.triangles = mesh.boundary;
    surface.fragment.assign(mesh.boundary.size(), 7);
    surface.torn.assign(mesh.boundary.size(), 0);
    return surface;
}

std::filesystem::path inTemp(const std::string& name)
{
    return std::filesystem::path(testing::TempDir()) / ("vdbfrac_" + name);
}

}  // namespace

TEST(TetFiles, ExtensionChoosesTheFormatInAnyCase)
{
    EXPECT_EQ(tetmesh::tetFormatOf("a.VTU"), TetFormat::vtu);
    EXPECT_EQ(tetmesh::tetFormatOf("a.msh"), TetFormat::gmsh41);
    EXPECT_EQ(tetmesh::tetFormatOf("a.ele"), TetFormat::tetgen);
    for (const char* name : {"a", "a.obj", "vtu", "a.vtu.gz"})
        EXPECT_THROW(tetmesh::tetFormatOf(name), InputError) << name;
}

TEST(TetFiles, FieldsOfAWrongLengthOrNameAreRefused)
{
    const auto file = inTemp("fields.vtu");
    const auto write = [&](const tetmesh::TetFields& fields) { writeTets(file, TetFormat::vtu, twoTets(), fields); };
    EXPECT_THROW(write({{}, {{"a", {1}}}}), InputError);
    EXPECT_THROW(write({{{"a", {1, 2}}}, {}}), InputError);
    EXPECT_THROW(write({{}, {{"with blank", {1, 2}}}}), InputError);
    EXPECT_THROW(write({{}, {{"", {1, 2}}}}), InputError);
    EXPECT_FALSE(std::filesystem::exists(file));
    EXPECT_NO_THROW(write({{{"a", {1, 2, 3, 4, 5}}}, {{"b_2", {1, 2}}}}));
    std::filesystem::remove(file);
}

TEST(TetFiles, AFolderThatIsNotThereIsAnErrorOfTheFile)
{
    for (auto format :
         {TetFormat::vtu, TetFormat::vtk, TetFormat::gmsh41, TetFormat::gmsh22, TetFormat::medit, TetFormat::tetgen})
        EXPECT_THROW(writeTets(inTemp("none") / "a.vtu", format, twoTets()), FileError);
}

TEST(SurfaceFiles, AreReadBackAsTheyWere)
{
    const tetmesh::Surface surface = shell();
    for (const char* extension : {".obj", ".ply", ".stl"}) {
        const auto file = inTemp(std::string("surface") + extension);
        ASSERT_TRUE(tetmesh::isSurfaceFile(file));
        tetmesh::writeSurface(file, surface);
        const tetmesh::PolygonSoup read = tetmesh::readSurface(file);
        ASSERT_EQ(read.polygons.size(), surface.triangles.size());
        // .ply keeps doubles; .obj has 9 digits and .stl floats.
        const double rounding = file.extension() == ".ply" ? 0 : file.extension() == ".obj" ? 1e-9 : 1e-7;
        for (std::size_t t = 0; t < read.polygons.size(); ++t)
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_LE((read.points[read.polygons[t][k]] - surface.points[surface.triangles[t][k]]).norm(), rounding)
                    << extension;
        std::filesystem::remove(file);
    }
}

/// As modelling programs close cylinders.
TEST(PlyFrames, HaveFacesOfManyCorners)
{
    tetmesh::DrawnTopology drawn;
    std::vector<tetmesh::RenderMesh::Corner> corners;
    for (std::uint32_t i = 0; i < 300; ++i) {
        drawn.mesh.points.emplace_back(std::cos(.02 * i), std::sin(.02 * i), 0);
        corners.push_back({i});
    }
    for (std::size_t count : {3, 300}) {
        drawn.mesh.addFace(std::span(corners).first(count), tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
        drawn.fragment.push_back(0), drawn.torn.push_back(0);
    }
    const std::filesystem::path file = std::filesystem::temp_directory_path() / "vdbfrac_long_faces.ply";
    const std::vector<Vec3> still(300, Vec3::Zero());
    const std::vector<tetmesh::PlyBody> bodies{{drawn, drawn.mesh.points, still, {}}};
    tetmesh::writePlyFrame(file, bodies, tetmesh::PlyOrder::asGiven, {});
    const tetmesh::PolygonSoup soup = tetmesh::readSurface(file);
    std::filesystem::remove(file);
    ASSERT_EQ(soup.polygons.size(), 2u);
    EXPECT_EQ(soup.polygons[0].size(), 3u);
    EXPECT_EQ(soup.polygons[1].size(), 300u);
    EXPECT_EQ(soup.points.size(), 300u);
}

TEST(SurfaceFiles, OtherExtensionsAreRefused)
{
    EXPECT_FALSE(tetmesh::isSurfaceFile("a.off"));
    EXPECT_THROW(tetmesh::writeSurface(inTemp("a.off"), shell()), InputError);
}

TEST(SurfaceFiles, WhatIsNoSurfaceIsRefused)
{
    const std::filesystem::path file = inTemp("no_surface.stl");
    tetmesh::Surface outside = shell(), bare = shell();
    outside.triangles.back()[2] = 5;
    bare.torn.clear();
    for (const tetmesh::Surface& s : {outside, bare}) EXPECT_THROW(tetmesh::writeSurface(file, s), InputError);
    EXPECT_FALSE(std::filesystem::exists(file));
}

/// Frames are asked for once, in order, and none is kept: what waits for its place in the text lies on disk, and is
/// gone afterwards, also where a frame cannot be had.
TEST(UsdFiles, AreWrittenFrameByFrame)
{
    constexpr std::size_t kFrames = 5;
    const std::filesystem::path folder = inTemp("usd_frames");
    std::filesystem::remove_all(folder);
    std::filesystem::create_directory(folder);
    tetmesh::DrawnTopology drawn;
    drawn.mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    drawn.mesh.addFace(std::array<tetmesh::RenderMesh::Corner, 3>{{{0}, {1}, {2}}}, 0, tetmesh::RenderMesh::kNone);
    drawn.fragment = {0}, drawn.torn = {0};
    const std::array<const tetmesh::DrawnTopology*, 2> bodies{&drawn, &drawn};
    std::size_t asked = 0;
    const auto frame = [&](std::size_t f) {
        EXPECT_EQ(f, asked++);
        tetmesh::CacheFrame own{drawn.mesh.points, drawn.mesh.points, {}};
        for (Vec3& p : own.points) p.z() = double(f);
        return std::vector<tetmesh::CacheFrame>(2, own);
    };
    const auto files = [&] {
        return std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator());
    };
    tetmesh::writeUsda(folder / "a.usda", {"a", {"one", "two"}, 24, 1001, ""}, bodies, kFrames, frame);
    EXPECT_EQ(asked, kFrames);
    EXPECT_EQ(files(), 1);
    const std::string text = readText(folder / "a.usda");
    const std::size_t first = text.find("1001: [(0, 0, 0), (1, 0, 0), (0, 1, 0)],"),
                      last = text.find("1005: [(0, 0, 4)");
    EXPECT_LT(first, last);
    EXPECT_NE(text.find("1003: [(0, 0, 2), (1, 1, 2)],"), std::string::npos) << text;  // the box
    const auto broken = [&](std::size_t f) {
        if (f == 3) throw FileError("motion", "is gone");
        return std::vector<tetmesh::CacheFrame>(2, {drawn.mesh.points, drawn.mesh.points, {}});
    };
    EXPECT_THROW(tetmesh::writeUsda(folder / "b.usda", {"b", {"one", "two"}, 24, 1, ""}, bodies, kFrames, broken),
                 FileError);
    EXPECT_EQ(files(), 1);
    EXPECT_NE(text.find("velocities.timeSamples"), std::string::npos);
    const auto still = [&](std::size_t) { return std::vector<tetmesh::CacheFrame>(2, {drawn.mesh.points, {}, {}}); };
    tetmesh::writeUsda(folder / "c.usda", {"c", {"one", "two"}, 24, 1, ""}, bodies, kFrames, still);
    EXPECT_EQ(readText(folder / "c.usda").find("velocities"), std::string::npos);
    std::filesystem::remove_all(folder);
}

/// Skin has its own texture coordinates, what has none those of a box: no face is smeared to a line.
TEST(UsdFiles, TornFacesHaveTextureCoordinatesOfABox)
{
    const std::filesystem::path file = inTemp("box.usda");
    tetmesh::DrawnTopology drawn;
    drawn.mesh.points = {{0, 0, 0}, {0, 2, 0}, {0, 0, 3}};
    drawn.mesh.uvs = {{.1, .2, 0}, {0, 0, 0}, {0, 2, 0}, {0, 0, 3}};
    drawn.mesh.addFace(std::array<tetmesh::RenderMesh::Corner, 3>{{{0, 0}, {1, 0}, {2, 0}}}, 0,
                       tetmesh::RenderMesh::kNone);
    drawn.mesh.addFace(std::array<tetmesh::RenderMesh::Corner, 3>{{{0, 1}, {1, 2}, {2, 3}}}, 0,
                       tetmesh::RenderMesh::kNone);
    drawn.mesh.addFace(std::array<tetmesh::RenderMesh::Corner, 3>{{{0}, {1}, {2}}}, 0, tetmesh::RenderMesh::kNone);
    drawn.fragment = {0, 0, 0}, drawn.torn = {0, 1, 0};
    const std::array<const tetmesh::DrawnTopology*, 1> bodies{&drawn};
    const std::string materials = "newmtl outside\nKd 1 1 1\nd 0.25\nKe 0 1 0\n";
    tetmesh::writeUsda(file, {"box", {"one"}, 24, 1, materials}, bodies, 1, [&](std::size_t) {
        return std::vector<tetmesh::CacheFrame>{{drawn.mesh.points, {}, {}}};
    });
    const std::string text = readText(file);
    EXPECT_NE(text.find("primvars:st = [(0.1, 0.2), (0.1, 0.2), (0.1, 0.2), (0, 0), (2, 0), (0, 3), (0, 0), (2, 0), "
                        "(0, 3)]"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("inputs:opacity = 0.25"), std::string::npos);
    EXPECT_NE(text.find("inputs:emissiveColor = (0, 1, 0)"), std::string::npos);
    std::filesystem::remove(file);
}
