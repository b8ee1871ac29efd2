// Reading users' meshes: quirks of the formats, damaged files, and CGAL's readers as the oracle for sound ones.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>
#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Simple_cartesian.h>

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::tetmesh;
namespace fs = std::filesystem;

namespace {

/// A folder of its own that goes with the test.
class SurfaceInput : public testing::Test {
protected:
    void SetUp() override
    {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() / ("vdbfrac-" + std::to_string(::getpid()) + "-" + info->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path write(const std::string& name, const std::string& content) const
    {
        writeText(folder_ / name, content);
        return folder_ / name;
    }
    PolygonSoup read(const std::string& name, const std::string& content) const
    {
        return readSurface(write(name, content));
    }
    std::string complaint(const std::string& name, const std::string& content) const
    {
        try {
            read(name, content);
        } catch (const InputError& e) {
            return e.what();
        }
        return "";
    }

    fs::path folder_;
};

const std::string kTetPoints = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kTetFaces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

template <class T>
void append(std::string& bytes, T value, bool bigEndian = false)
{
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (bigEndian) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
}

const double kTet[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const int kTetTriangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string binaryStl(const std::string& head, std::uint32_t count, float first = 0)
{
    std::string bytes = head + std::string(80 - head.size(), ' ');
    append(bytes, count);
    for (const auto& triangle : kTetTriangles) {
        for (int i = 0; i < 3; ++i) append(bytes, 0.f);
        for (int corner : triangle)
            for (int a = 0; a < 3; ++a) append(bytes, corner == 0 && a == 0 ? first : float(kTet[corner][a]));
        append(bytes, std::uint16_t{0});
    }
    return bytes;
}

std::string plyHeader(const std::string& format, std::size_t points, std::size_t faces)
{
    return "ply\nformat " + format + " 1.0\ncomment a tet\nelement vertex " + std::to_string(points) +
           "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face " +
           std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string binaryPly(bool big)
{
    std::string bytes = plyHeader(big ? "binary_big_endian" : "binary_little_endian", 4, 4);
    for (const auto& X : kTet) {
        for (double x : X) append(bytes, float(x), big);
        append(bytes, std::uint8_t{200});
    }
    for (const auto& triangle : kTetTriangles) {
        append(bytes, std::uint8_t{3});
        for (int corner : triangle) append(bytes, std::int32_t(corner), big);
    }
    return bytes;
}

const std::string kTextPly =
    plyHeader("ascii", 4, 4) + "0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
const std::string kOff = "OFF\n# a tet\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string textStl()
{
    std::string text = "solid tet\n";
    for (const auto& triangle : kTetTriangles) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (int c : triangle)
            text += "vertex " + std::to_string(kTet[c][0]) + " " + std::to_string(kTet[c][1]) + " " +
                    std::to_string(kTet[c][2]) + "\n";
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid tet\n";
}

void expectTet(const PolygonSoup& soup)
{
    const SurfaceReport report = examine(soup);
    EXPECT_EQ(soup.points.size(), 4u);
    EXPECT_TRUE(report.closed);
    EXPECT_DOUBLE_EQ(report.volume, 1. / 6);
}

TEST_F(SurfaceInput, EveryFormatGivesTheSameTet)
{
    expectTet(read("t.obj", kTetPoints + kTetFaces));
    expectTet(read("t.off", kOff));
    expectTet(read("t.ply", kTextPly));
    expectTet(read("t.PLY", binaryPly(false)));
    expectTet(read("t.ply", binaryPly(true)));
    expectTet(read("t.stl", textStl()));
    expectTet(read("t.stl", binaryStl("from a test", 4)));
}

TEST_F(SurfaceInput, AgreesWithCgalOnSoundFiles)
{
    using Point = CGAL::Simple_cartesian<double>::Point_3;
    const std::vector<std::pair<std::string, std::string>> files = {{"a.obj", kTetPoints + kTetFaces},
                                                                    {"a.off", kOff},
                                                                    {"a.ply", kTextPly},
                                                                    {"b.ply", binaryPly(false)},
                                                                    {"c.ply", binaryPly(true)},
                                                                    {"a.stl", textStl()},
                                                                    {"b.stl", binaryStl("x", 4)}};
    for (const auto& [name, content] : files) {
        const PolygonSoup ours = read(name, content);
        std::vector<Point> points;
        std::vector<std::vector<std::size_t>> polygons;
        ASSERT_TRUE(CGAL::IO::read_polygon_soup((folder_ / name).string(), points, polygons)) << name;
        ASSERT_EQ(ours.points.size(), points.size()) << name;
        for (std::size_t i = 0; i < points.size(); ++i)
            EXPECT_EQ(ours.points[i], Vec3(points[i].x(), points[i].y(), points[i].z())) << name;
        EXPECT_EQ(ours.polygons, polygons) << name;
    }
}

TEST_F(SurfaceInput, PlyStripsAreRead)
{
    // A tet as a strip of four triangles, then one as two strips of two, parted by -1 and led on by a corner that is
    // there twice.
    const std::vector<std::vector<int>> strips = {{0, 2, 1, 3, 0, 2}, {1, 0, 2, 3, -1, 0, 0, 0, 1, 3, 2}};
    for (const std::vector<int>& strip : strips)
        for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
            const bool big = format[7] == 'b', text = format[0] == 'a';
            std::string bytes =
                std::string("ply\nformat ") + format +
                " 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement tristrips 1\n"
                "property list int int vertex_indices\nend_header\n";
            const auto add = [&](auto value) {
                text ? void(bytes += std::to_string(value) + " ") : append(bytes, value, big);
            };
            const auto endLine = [&] { bytes += text ? "\n" : ""; };
            for (const auto& X : kTet) {
                for (double x : X) add(x);
                endLine();
            }
            add(std::int32_t(strip.size()));
            for (int corner : strip) add(std::int32_t(corner));
            endLine();
            const PolygonSoup soup = read("t.ply", bytes);
            EXPECT_EQ(soup.polygons.size(), 4u) << format;
            expectTet(soup);
            EXPECT_TRUE(examine(soup).oriented) << format;
        }
    EXPECT_NE(complaint("t.ply",
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
                        "z\nelement tristrips 1\n"
                        "property list int int vertex_indices\nend_header\n0 0 0\n3 0 0 7\n")
                  .find("point index 7"),
              std::string::npos);
}

TEST_F(SurfaceInput, FacesThatDisagreeAboutTheirSidesAreTold)
{
    EXPECT_TRUE(examine(read("t.obj", kTetPoints + kTetFaces)).oriented);
    EXPECT_FALSE(examine(read("t.obj", kTetPoints + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 4 3 2\n")).oriented);
}

/// By the names that programs write; where a component is missing there are none.
TEST_F(SurfaceInput, PlyHasTextureCoordinatesAndNormals)
{
    const auto read = [&](const std::string& names) {
        std::string header = "ply\nformat ascii 1.0\nelement vertex 3\n";
        for (const std::string& name : {std::string("x y z"), names}) {
            std::istringstream words(name);
            for (std::string word; words >> word;) header += "property float " + word + "\n";
        }
        return readRenderMesh(write("t.ply", header +
                                                 "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                                 "0 0 0 0 0 1 .25 .5\n1 0 0 1 0 0 1 0\n0 1 0 0 1 0 0 1\n3 0 1 2\n"));
    };
    for (const char* uv : {"s t", "u v", "texture_u texture_v"}) {
        const RenderMesh mesh = read(std::string("nx ny nz ") + uv);
        ASSERT_EQ(mesh.corners.size(), 3u) << uv;
        EXPECT_EQ(mesh.uvs[mesh.corners[0].uv], Vec3(.25, .5, 0)) << uv;
        EXPECT_EQ(mesh.uvs[mesh.corners[2].uv], Vec3(0, 1, 0)) << uv;
        EXPECT_EQ(mesh.normals[mesh.corners[1].normal], Vec3(1, 0, 0)) << uv;
        EXPECT_EQ(mesh.normals[mesh.corners[2].normal], Vec3(0, 1, 0)) << uv;
    }
    for (const char* names : {"nx ny mz s v", "a b c u vt"}) {
        const RenderMesh none = read(names);
        EXPECT_TRUE(none.uvs.empty() && none.normals.empty());
        EXPECT_EQ(none.corners[0].uv, RenderMesh::kNone);
    }
    EXPECT_TRUE(read("u v w a b").uvs.empty()) << "a velocity";
    EXPECT_EQ(read("s t nx ny nz").corners[0].normal, 0u);
    EXPECT_EQ(read("a nx ny b nz").corners[0].normal, 0u);
    EXPECT_EQ(read("a nx ny b nz").corners[1].normal, RenderMesh::kNone) << "zeros";
}

/// What is not used may be anything, in text as in binary; places may not.
TEST_F(SurfaceInput, PlyTextMayHaveValuesThatAreNotFinite)
{
    const auto text = [](const std::string& x, const std::string& quality) {
        return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
               "property float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
               x + " 0 0 " + quality + "\n1 0 0 1e35\n0 1 0 -inf\n3 0 1 2\n";
    };
    EXPECT_EQ(readRenderMesh(write("t.ply", text("0", "nan"))).points.size(), 3u);
    EXPECT_NE(complaint("t.ply", text("nan", "0")).find("not finite"), std::string::npos);
    EXPECT_NE(complaint("t.ply", text("2e30", "0")).find("too large"), std::string::npos);
    EXPECT_NE(complaint("t.ply", text("0", "none")).find("'none' is not a number"), std::string::npos);
}

TEST_F(SurfaceInput, OffMayHaveACommentBehindItsKeyword)
{
    expectTet(
        read("t.off",
             "OFF # made by a 2.0\n4 4 6 # counts\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"));
}

TEST_F(SurfaceInput, ObjQuirksAreRead)
{
    expectTet(read("t.obj", kTetPoints + "f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1"));
    expectTet(read("t.obj", kTetPoints + "vn 0 0 1\nvt 0 0\nf 1// 3// 2//\nf 1/1 2/1 4/1\nf 1/1/1 4/1/1 3/1/1\n"
                                         "f 2//1 3//1 4//1"));
    std::string windows = "mtllib none.mtl\n# a comment\n\ng a b\no x\ns off\nusemtl m\n" + kTetPoints + kTetFaces;
    for (std::size_t at = 0; (at = windows.find('\n', at)) != std::string::npos; at += 2)
        windows.replace(at, 1, "\r\n");
    expectTet(read("t.obj", windows));
    expectTet(read("t.obj", "\xEF\xBB\xBF" + kTetPoints + kTetFaces));  // a byte order mark
    expectTet(read("t.obj", kTetPoints + "f 1 3 \\\n2\nf 1 2 4 # last\nf 1 4 3\nf 2 3 4\nf 1 2\nf 1\nl 1 2\n"));
    expectTet(read("t.obj", "v 0. 0 0e5\nv +1 0 0 1 0.5 0.5\nv 0 1.0 0\n\tv 0 0 10e-1\n" + kTetFaces));
}

TEST_F(SurfaceInput, ObjMistakesAreNamedWithTheirLine)
{
    EXPECT_NE(complaint("t.obj", kTetPoints + "f 1 2 0\n").find("t.obj:5"), std::string::npos);
    EXPECT_NE(complaint("t.obj", kTetPoints + "f 1 2 5\n").find("t.obj:5"), std::string::npos);
    EXPECT_NE(complaint("t.obj", kTetPoints + "f 1 2 -5\n").find("t.obj:5"), std::string::npos);
    EXPECT_NE(complaint("t.obj", kTetPoints + "f 1 2 99999999999999999999\n").find("t.obj:5"), std::string::npos);
    EXPECT_NE(complaint("t.obj", "v 0 0 nan\n" + kTetFaces).find("t.obj:1"), std::string::npos);
    EXPECT_NE(complaint("t.obj", "v 0 inf 0\n").find("t.obj:1"), std::string::npos);
    EXPECT_NE(complaint("t.obj", "v 0 1e999 0\n").find("t.obj:1"), std::string::npos);
    EXPECT_NE(complaint("t.obj", "v 0 0\n").find("t.obj:1"), std::string::npos);
    EXPECT_NE(complaint("t.obj", "v 0,5 0 0\n").find("t.obj:1"), std::string::npos);
    EXPECT_NE(complaint("t.obj", std::string("v 0 0 0\nv 1 \0 0\n", 16)).find("t.obj:2"), std::string::npos);
    EXPECT_NE(complaint("t.obj", ""), "");
    EXPECT_NE(complaint("t.obj", kTetPoints), "");
    EXPECT_NE(complaint("t.xyz", kTetPoints), "");
}

TEST_F(SurfaceInput, FaceOfAMillionCornersIsRead)
{
    std::string text = kTetPoints + "f";
    for (int i = 0; i < 1000000; ++i) text += i % 2 ? " 1" : " 2";
    EXPECT_EQ(read("t.obj", text).polygons.at(0).size(), 1000000u);
}

TEST_F(SurfaceInput, StlIsToldApartByItsSize)
{
    expectTet(read("t.stl", binaryStl("solid but binary", 4)));
    EXPECT_NE(complaint("t.stl", binaryStl("x", 4000000000u)), "");
    EXPECT_NE(complaint("t.stl", binaryStl("x", 5)), "");
    EXPECT_NE(complaint("t.stl", binaryStl("x", 4, std::numeric_limits<float>::quiet_NaN())).find("not finite"),
              std::string::npos);
    EXPECT_NE(complaint("t.stl", "short"), "");
    EXPECT_NE(complaint("t.stl", "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 nan\n").find(":4"),
              std::string::npos);
    EXPECT_NE(complaint("t.stl", "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 1\n"), "");
}

TEST_F(SurfaceInput, DeclaredCountsAreNotBelieved)
{
    const std::string body = kTextPly.substr(kTextPly.find("end_header"));
    EXPECT_NE(complaint("t.ply", plyHeader("ascii", 4000000000u, 4) + "0 0 0 1\n"), "");
    EXPECT_NE(complaint("t.ply", plyHeader("ascii", 5, 4) + body.substr(11)), "");
    EXPECT_NE(complaint("t.ply", plyHeader("ascii", 1, 1) + "0 0 0 1\n255 0 0 0\n"), "");
    EXPECT_NE(complaint("t.ply", plyHeader("ascii", 1, 1) + "0 0 0 1\n3 0 0 1\n"), "");
    EXPECT_NE(complaint("t.ply", plyHeader("ascii", 1, 1) + "0 0 0 1\n3 0 0 -1\n"), "");
    const std::string binary = binaryPly(false);
    for (std::size_t cut = 1; cut < binary.size(); cut += 7) EXPECT_NE(complaint("t.ply", binary.substr(0, cut)), "");
    std::string list =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
    list += std::string(12, '\0') + std::string(4, '\xff') + "1234";
    EXPECT_NE(complaint("t.ply", list).find("list count"), std::string::npos);
    EXPECT_NE(complaint("t.off", "OFF\n4000000000 4 0\n0 0 0\n"), "");
    EXPECT_NE(complaint("t.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n"), "");
    EXPECT_NE(complaint("t.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n").find("t.off:4"), std::string::npos);
}

TEST_F(SurfaceInput, MissingFilesAndFoldersAreFileErrors)
{
    EXPECT_THROW(readSurface(folder_ / "none.obj"), FileError);
    fs::create_directory(folder_ / "folder.obj");
    EXPECT_THROW(readSurface(folder_ / "folder.obj"), FileError);
}

TEST_F(SurfaceInput, FilesTooLargeForTheMemoryAreNotRead)
{
    const fs::path file = write("t.obj", kTetPoints + kTetFaces);
    EXPECT_THROW(readSurface(file, fs::file_size(file)), LimitError);
    EXPECT_NO_THROW(readSurface(file, 100 * fs::file_size(file)));
}

TEST_F(SurfaceInput, ReportCountsOpenAndCrowdedEdges)
{
    PolygonSoup open = read("t.obj", kTetPoints + "f 1 3 2\nf 1 2 4\nf 1 4 3\n");
    EXPECT_FALSE(examine(open).closed);
    EXPECT_EQ(examine(open).openEdges, 3u);
    PolygonSoup crowded = read("t.obj", kTetPoints + "v 0 0 -1\n" + kTetFaces + "f 1 2 3\nf 1 5 2\nf 1 3 5\nf 2 5 3\n");
    EXPECT_TRUE(examine(crowded).closed);
    EXPECT_EQ(examine(crowded).nonManifoldEdges, 3u);
    PolygonSoup flat = read("t.obj", kTetPoints + kTetFaces + "f 1 2 2\n");
    EXPECT_EQ(examine(flat).degenerateFaces, 1u);
    EXPECT_EQ(examine(flat).upper, Vec3(1, 1, 1));
}

TEST_F(SurfaceInput, SplitSeamsStayClosed)
{
    const SurfaceReport report =
        examine(read("t.obj", kTetPoints + kTetPoints + "f 1 3 2\nf 5 6 8\nf 1 8 7\nf 6 3 4\n"));
    EXPECT_TRUE(report.closed);
    EXPECT_EQ(report.nonManifoldEdges, 0u);
}

TEST_F(SurfaceInput, FrameSurvivesWritingAndReading)
{
    Surface surface;
    for (const auto& X : kTet) surface.points.emplace_back(X[0] / 3, X[1] / 3, X[2] / 3);
    for (std::uint32_t id : {12345u, 3u})
        for (const auto& t : kTetTriangles) {
            surface.triangles.push_back({std::uint32_t(t[0]), std::uint32_t(t[1]), std::uint32_t(t[2])});
            surface.fragment.push_back(id);
            surface.torn.push_back(std::uint8_t(id == 3 && t[0] == 1));
        }
    writeObj(folder_ / "f.obj", surface, "f.mtl");
    writeMtl(folder_ / "f.mtl");
    const std::string text = readText(folder_ / "f.obj");
    EXPECT_TRUE(text.starts_with("mtllib f.mtl\no fragment_0003\nv 0 0 0\nv 0.333333333 0 0\n")) << text;
    EXPECT_NE(text.find("g fragment_0003_inside\nusemtl inside\nf 2 3 4\n"), std::string::npos) << text;
    EXPECT_NE(text.find("o fragment_12345\n"), std::string::npos);
    EXPECT_EQ(text.find("fragment_12345_inside"), std::string::npos);

    const Surface back = readObjFrame(folder_ / "f.obj");
    EXPECT_EQ(back.points.size(), 8u);
    EXPECT_EQ(back.triangles.size(), 8u);
    EXPECT_EQ(back.fragment, (std::vector<std::uint32_t>{3, 3, 3, 3, 12345, 12345, 12345, 12345}));
    EXPECT_EQ(back.torn, (std::vector<std::uint8_t>{0, 0, 0, 1, 0, 0, 0, 0}));
    EXPECT_NEAR(back.points[1].x(), 1. / 3, 1e-9);
    EXPECT_EQ(readSurface(folder_ / "f.obj").polygons.size(), 8u);
}

}  // namespace
