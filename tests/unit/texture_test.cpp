// Textures: where their pixels lie on a surface, what light they are, and what is told of those that are not there.
#include "folder_test.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/pictures/texture.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

using namespace vdbfrac;
using namespace vdbfrac::pictures;

namespace {

constexpr std::array<int, 4> kBytes{40, 110, 180, 250};  // upper left, upper right, lower left, lower right

Image fourGreys()
{
    Image image{2, 2, {}};
    for (int byte : kBytes) image.rgb.insert(image.rgb.end(), 3, std::uint8_t(byte));
    return image;
}

/// What a screen makes of a byte.
double light(int byte)
{
    const double s = byte / 255.;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

/// The square [0, 1]^2 of a material, x and y as texture coordinates.
tetmesh::DrawnTopology square(bool torn = false)
{
    tetmesh::DrawnTopology drawn;
    std::vector<tetmesh::RenderMesh::Corner> corners;
    for (std::uint32_t i = 0; i < 4; ++i) {
        drawn.mesh.points.emplace_back(i == 1 || i == 2, i >= 2, 0);
        drawn.mesh.uvs.push_back(drawn.mesh.points.back());
        corners.push_back({i, i});
    }
    drawn.mesh.materials = {"skin"};
    drawn.mesh.addFace(corners, tetmesh::RenderMesh::kNone, 0);
    drawn.fragment = {0}, drawn.torn = {torn};
    return drawn;
}

constexpr int kPixels = 101;

Image picture(const tetmesh::DrawnTopology& drawn, const Paint& paint)
{
    const Subject subject = subjectOf(drawn, drawn.mesh.points, paint);
    View view;
    view.width = view.height = kPixels;
    view.camera = fittingCamera({0, 0, -1}, subject.points, kPixels, kPixels);
    return render(subject, view);
}

/// Light that a texture lets through at (u, v) of the square: that of its picture over that of a white one.
double shareAt(const Image& textured, const Image& white, double u, double v)
{
    constexpr double kMargin = 0.06;  // of the picture beside the square
    const auto place = [](double t) { return int((kMargin + (1 - 2 * kMargin) * t) * kPixels); };
    const std::size_t at = 3 * std::size_t(place(1 - v) * kPixels + place(u));
    return light(textured.rgb[at]) / light(white.rgb[at]);
}

// Gloss is added to all colours, bytes are coarse, and a pixel is 1/45 of the way from one grey to the next.
constexpr double kTolerance = 0.06;

Paint texturedPaint(const MaterialTexture& texture)
{
    Paint paint;
    paint.textures["skin"] = texture;
    return paint;
}

Paint white()
{
    Paint paint;
    paint.materials["skin"] = Vec3(1, 1, 1);
    return paint;
}

class TextureFiles : public test::FolderTest {};

TEST(Texture, HasItsFirstRowAtTheTopAndRepeats)
{
    const Image image = fourGreys();
    for (int repeat : {-2, -1, 0, 1, 5})
        for (std::size_t k = 0; k < 4; ++k) {
            const double u = k % 2 ? 0.75 : 0.25, v = k < 2 ? 0.75 : 0.25;
            const Colour colour = textureColour(image, u + repeat, v - repeat);
            EXPECT_TRUE(colour.isApprox(Colour::Constant(float(light(kBytes[k]))), 1e-5f)) << k << " " << repeat;
        }
}

TEST(Texture, IsTheMeanOfLightBetweenPixels)
{
    const Image image = fourGreys();
    const auto at = [&](double u, double v) { return double(textureColour(image, u, v)[0]); };
    const auto mean = [](int a, int b) { return (light(a) + light(b)) / 2; };
    EXPECT_NEAR(at(0.5, 0.75), mean(kBytes[0], kBytes[1]), 1e-6);
    EXPECT_NEAR(at(0.25, 0.5), mean(kBytes[0], kBytes[2]), 1e-6);
    EXPECT_NEAR(at(0, 0.25), mean(kBytes[2], kBytes[3]), 1e-6);  // over the edge, since it repeats
    EXPECT_NEAR(at(0.375, 0.25), 0.75 * light(kBytes[2]) + 0.25 * light(kBytes[3]), 1e-6);
    EXPECT_TRUE(std::isfinite(at(std::numeric_limits<double>::infinity(), 0)));
    EXPECT_TRUE(textureColour({}, 0.5, 0.5).isApprox(Colour::Ones()));
}

TEST(Texture, LiesOnASurfaceAsItsCoordinatesSay)
{
    const tetmesh::DrawnTopology drawn = square();
    const Image lit = picture(drawn, white());
    const auto texture = std::make_shared<const Image>(fourGreys());
    const Image once = picture(drawn, texturedPaint({texture}));
    const Image twice = picture(drawn, texturedPaint({texture, {2, 2}, {0.5f, 0}}));
    for (double u : {0.125, 0.25, 0.375, 0.625, 0.75, 0.875})
        for (double v : {0.125, 0.25, 0.5, 0.75, 0.875}) {
            EXPECT_NEAR(shareAt(once, lit, u, v), textureColour(*texture, u, v)[0], kTolerance) << u << " " << v;
            EXPECT_NEAR(shareAt(twice, lit, u, v), textureColour(*texture, 2 * u + 0.5, 2 * v)[0], kTolerance)
                << u << " " << v;
        }
}

TEST(Texture, IsMultipliedByTheColourOfItsMaterialAndNotOnTornFaces)
{
    const auto texture = std::make_shared<const Image>(fourGreys());
    Paint paint = texturedPaint({texture});
    paint.materials["skin"] = Vec3(0.7, 0.7, 0.7);
    const tetmesh::DrawnTopology whole = square(), torn = square(true);
    const double share = shareAt(picture(whole, paint), picture(whole, white()), 0.75, 0.25);
    EXPECT_NEAR(share, std::pow(0.7, 2.2) * light(kBytes[3]), kTolerance);
    Paint plain;
    EXPECT_EQ(picture(torn, paint).rgb, picture(torn, plain).rgb);
    // Fragments and values are told by colours of their own.
    plain.by = paint.by = ColourBy::fragment;
    EXPECT_EQ(picture(whole, paint).rgb, picture(whole, plain).rgb);
    paint.by = ColourBy::material;
    Subject byValue = subjectOf(whole, whole.mesh.points, paint);
    EXPECT_EQ(byValue.textured.size(), byValue.triangles.size());
    colourByValue(byValue, std::vector<float>(4, 1.f), {});
    EXPECT_TRUE(byValue.textured.empty());
}

TEST_F(TextureFiles, AreReadOnceAndWhatCannotBeReadIsTold)
{
    writePng(folder_ / "good one.png", fourGreys());
    const std::string whole = readText(folder_ / "good one.png");
    write("half.png", whole.substr(0, whole.size() / 2));
    write("photo.jpg", "\xff\xd8\xff");
    const std::string mtl =
        "newmtl a\nmap_Kd none.png\nnewmtl b\nmap_Kd none.png\nnewmtl c\nmap_Kd -s 2 3 1 -o .5 good one.png\r\n"
        "newmtl d\nmap_Kd photo.jpg\nnewmtl e\nmap_Kd half.png\nnewmtl f\nKd 1 1 1\nnewmtl g h\nmap_Kd good one.png\n";
    const ReadTextures read = readTextures(mtl, folder_);
    ASSERT_EQ(read.textures.size(), 2u);
    const MaterialTexture& c = read.textures.at("c");
    EXPECT_EQ(c.image, read.textures.at("g h").image);
    EXPECT_EQ(c.image->rgb, fourGreys().rgb);
    EXPECT_TRUE(c.scale.isApprox(Eigen::Array2f(2, 3)) && c.offset.isApprox(Eigen::Array2f(.5f, 0)));
    ASSERT_EQ(read.notes.size(), 3u);
    for (const auto& [note, name] : {std::pair{0, "none.png"}, {1, "photo.jpg"}, {2, "half.png"}}) {
        EXPECT_NE(read.notes[std::size_t(note)].find((folder_ / name).string()), std::string::npos)
            << read.notes[std::size_t(note)];
        EXPECT_NE(read.notes[std::size_t(note)].find("drawn without it"), std::string::npos);
    }
    EXPECT_TRUE(readTextures("", folder_).textures.empty());
}

TEST_F(TextureFiles, HaveNamesWithBlanksBehindOptions)
{
    const std::filesystem::path file =
        write("x.mtl", "newmtl a\n  map_Kd -clamp on -mm 0 1 -s 2 my wood.png \nbump -bm 0.5 /there/b.png\nmap_Kd\n");
    const std::string there = std::filesystem::absolute(folder_).string() + "/";
    const std::string mtl = tetmesh::readMtl(file);
    EXPECT_EQ(
        mtl, "newmtl a\n  map_Kd -clamp on -mm 0 1 -s 2 " + there + "my wood.png\nbump -bm 0.5 /there/b.png\nmap_Kd\n");
    const auto maps = tetmesh::diffuseMaps(mtl);
    ASSERT_EQ(maps.size(), 1u);
    EXPECT_EQ(maps.at("a").file, there + "my wood.png");
    EXPECT_TRUE(maps.at("a").scale.isApprox(Eigen::Array2d(2, 1)));
}

/// A line names several files, or one with blanks in its name.
TEST_F(TextureFiles, LibrariesAreThoseThatAreThere)
{
    const auto both = write("my wood.mtl", "newmtl a\n");
    write("x.mtl", "newmtl b\n");
    const std::vector<std::string> names{"my wood.mtl", "x.mtl y.mtl", "none.mtl"};
    const std::vector<std::filesystem::path> expected{both, folder_ / "x.mtl", folder_ / "y.mtl", folder_ / "none.mtl"};
    EXPECT_EQ(tetmesh::libraryFiles(names, folder_), expected);
}

/// As the format allows; what is no colour is none, and no error.
TEST(DiffuseColours, MayBeGreyOrMissing)
{
    const auto colours = tetmesh::diffuseColours(
        "newmtl grey\nKd 0.8\nnewmtl blue\nKd 0 .1 1\nnewmtl s\nKd spectral a.rfl 1\nnewmtl x\nKd xyz 1 2 3\n"
        "newmtl two\nKd 1 2\nnewmtl odd\nKd nan 0 0\nnewmtl none\nKd\n");
    ASSERT_EQ(colours.size(), 3u);
    EXPECT_EQ(colours.at("grey"), Vec3(.8, .8, .8));
    EXPECT_EQ(colours.at("blue"), Vec3(0, .1, 1));
    EXPECT_EQ(colours.at("two"), Vec3(1, 2, 1));
}

/// Opaque and dark is what is not told.
TEST(Lights, AreOfWhatLetsThroughOrShines)
{
    const auto lights = tetmesh::lightsOf(
        "newmtl plain\nKd 1 1 1\nd 1\nKe 0 0 0\nnewmtl glass\nd 0.4\nnewmtl other\nTr 0.25\nnewmtl lamp\nKe 1 2 3\n"
        "newmtl odd\nd halo\nKe none\n");
    ASSERT_EQ(lights.size(), 3u);
    EXPECT_EQ(lights.at("glass").opacity, .4);
    EXPECT_EQ(lights.at("other").opacity, .75);
    EXPECT_EQ(lights.at("lamp").emitted, Vec3(1, 2, 3));
    EXPECT_EQ(lights.at("lamp").opacity, 1);
}

}  // namespace
