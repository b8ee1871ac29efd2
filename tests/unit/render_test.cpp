// Pictures: what is torn shows red, what is empty shows the background.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/pictures/render.h>

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::pictures;

namespace {

/// The cube [0,1]^3, its face at z = 1 torn.
tetmesh::DrawnTopology tornCube()
{
    tetmesh::DrawnTopology drawn;
    for (int i = 0; i < 8; ++i) drawn.mesh.points.emplace_back(i & 1, i >> 1 & 1, i >> 2);
    const std::array<std::array<std::uint32_t, 4>, 6> quads{
        {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
    for (std::size_t q = 0; q < quads.size(); ++q) {
        std::vector<tetmesh::RenderMesh::Corner> corners;
        for (std::uint32_t p : quads[q]) corners.push_back({p});
        drawn.mesh.addFace(corners, tetmesh::RenderMesh::kNone, tetmesh::RenderMesh::kNone);
        drawn.fragment.push_back(0);
        drawn.torn.push_back(q == 1);
    }
    return drawn;
}

Subject subject()
{
    const tetmesh::DrawnTopology cube = tornCube();
    return subjectOf(cube, cube.mesh.points);
}

View from(const Vec3& direction)
{
    View view;
    view.width = 161, view.height = 121;
    view.camera = fittingCamera(direction, subject().points, view.width, view.height);
    return view;
}

std::array<int, 3> pixel(const Image& image, int i, int j)
{
    const std::uint8_t* p = &image.rgb[3 * std::size_t(j * image.width + i)];
    return {p[0], p[1], p[2]};
}

bool isRed(const std::array<int, 3>& p) { return p[0] > 2 * p[1] && p[0] > 2 * p[2] && p[0] > 40; }
bool isGrey(const std::array<int, 3>& p) { return std::abs(p[0] - p[1]) < 25 && std::abs(p[1] - p[2]) < 25; }

}  // namespace

TEST(Render, TornFaceIsRedFromItsSideOnly)
{
    const Image front = render(subject(), from({0, 0, -1}));
    const Image back = render(subject(), from({0, 0, 1}));
    for (int i : {65, 80, 95})
        for (int j : {45, 60, 75}) {
            EXPECT_TRUE(isRed(pixel(front, i, j))) << i << " " << j;
            EXPECT_TRUE(isGrey(pixel(back, i, j))) << i << " " << j;
        }
}

TEST(Render, EmptySpaceShowsTheBackground)
{
    const Image cube = render(subject(), from({0, 0, -1}));
    const Image empty = render({}, from({0, 0, -1}));
    for (int i : {0, 10, 160})
        for (int j : {0, 60, 120}) {
            EXPECT_EQ(pixel(cube, i, j), pixel(empty, i, j));
            EXPECT_TRUE(isGrey(pixel(cube, i, j)));
            EXPECT_GT(pixel(cube, i, j)[0], 150);
        }
}

/// Points may come frame by frame.
TEST(Render, CamerasFitPartsAsTheyFitTheWhole)
{
    const std::vector<Vec3> points = subject().points;
    const Vec3 direction(-.5, -.35, -1);
    CameraFit fit(direction, 161, 121);
    for (const Vec3& p : points) fit.add({&p, 1});
    const Camera whole = fittingCamera(direction, points, 161, 121);
    EXPECT_EQ(fit.camera().eye, whole.eye);
    EXPECT_EQ(fit.camera().direction, whole.direction);
}

TEST(Render, SmallerPicturesHaveTheMeansOfTheirPixels)
{
    const Image image{
        5, 2, {0, 0, 0, 10, 20, 30, 1, 1, 1, 2, 2, 2, 9, 9, 9, 20, 20, 20, 30, 0, 90, 1, 1, 1, 2, 2, 2, 9, 9, 9}};
    const Image small = reduced(image, 2);
    EXPECT_EQ(small.width, 2);
    EXPECT_EQ(small.height, 1);
    EXPECT_EQ(small.rgb, (std::vector<std::uint8_t>{15, 10, 35, 2, 2, 2}));
    EXPECT_EQ(reduced(image, 1).rgb, image.rgb);
}

/// A body that was eaten up leaves the floor that other frames have.
TEST(Render, AFloorNeedsNothingOnIt)
{
    View view = from({0, -1, -1});
    view.ground = 0;
    EXPECT_TRUE(isGrey(pixel(render({}, view), 80, 100)));
}

TEST(Render, CameraSeesAllOfItAndNoMoreThanAMargin)
{
    for (const Vec3& direction : {Vec3(0, 0, -1), Vec3(-.5, -.35, -1), Vec3(0, -1, 0), Vec3(1, .2, .1)}) {
        const Image picture = render(subject(), from(direction));
        const Image empty = render({}, from(direction));
        int left = 161, right = -1, top = 121, bottom = -1;
        for (int j = 0; j < 121; ++j)
            for (int i = 0; i < 161; ++i)
                if (pixel(picture, i, j) != pixel(empty, i, j)) {
                    left = std::min(left, i), right = std::max(right, i);
                    top = std::min(top, j), bottom = std::max(bottom, j);
                }
        EXPECT_GT(left, 2);
        EXPECT_GT(top, 2);
        EXPECT_LT(right, 158);
        EXPECT_LT(bottom, 118);
        EXPECT_TRUE(bottom - top > 95 || right - left > 130) << direction.transpose();
    }
}

TEST(Render, AFloorHasAShadowUnderWhatStandsOnIt)
{
    View view = from({-.3, -.6, -1});
    const Image without = render(subject(), view);
    view.ground = 0;
    const Image with = render(subject(), view);
    int darker = 0;
    for (std::size_t p = 0; p < with.rgb.size(); p += 3) darker += with.rgb[p] + 40 < without.rgb[p];
    EXPECT_GT(darker, 200);
}

/// A press from above hides nothing and takes no light, from behind nobody sees it, and from in front it is there.
TEST(Render, BackdropsHideNothing)
{
    Subject pressed = subject();
    pressed.backdrops = {{{.5, 1, .5}, 9 * Vec3::UnitX(), 9 * Vec3::UnitZ(), Colour(0, 0, 1)}};
    View view = from({0.3, -0.8, -0.6});
    view.ground = 0;
    EXPECT_EQ(render(pressed, view).rgb, render(subject(), view).rgb);
    view.camera = from({0, 0.8, -0.6}).camera;
    view.ground.reset();
    const std::array<int, 3> above = pixel(render(pressed, view), 80, 2);
    EXPECT_GT(above[2], 2 * above[0]);
    EXPECT_FALSE(isGrey(above));
}

/// Of a shot: what goes and comes in it does not change the light on the floor far from it.
TEST(Render, AFloorIsLitAlikeInAllPicturesOfAShot)
{
    View view = from({0, -1, -1});
    view.ground = 0;
    // Crumbs, which shade next to nothing.
    Subject near = subject(), far = subject();
    for (Vec3& p : near.points) p *= .01;
    for (Vec3& p : far.points) p = .01 * p + Vec3(0, 2, 0) * (p.x() > .5);
    const auto corner = [&](const Subject& s) { return pixel(render(s, view), 2, 118)[0]; };
    EXPECT_GT(std::abs(corner(near) - corner(far)), 4);
    view.stage.emplace(far.points);
    EXPECT_LE(std::abs(corner(near) - corner(far)), 2);
}

/// What has flown off far away takes no shadows from the rest.
TEST(Render, ShadowsStayWhenAPieceIsFarAway)
{
    View view = from({0.3, -0.8, -0.6});
    view.ground = 0;
    Subject far = subject();
    const auto first = std::uint32_t(far.points.size());
    for (const Vec3& p : {Vec3(0, 3e4, 0), Vec3(1, 3e4, 0), Vec3(0, 3e4, 1)}) far.points.push_back(p);
    far.triangles.push_back({first, first + 1, first + 2});
    far.normals.push_back({Vec3::UnitY(), Vec3::UnitY(), Vec3::UnitY()});
    far.colour.push_back(Colour::Ones());
    const Image with = render(far, view), without = render(subject(), view);
    int others = 0;
    for (int j = 0; j < view.height; ++j)
        for (int i = 0; i < view.width; ++i) {
            const auto a = pixel(with, i, j), b = pixel(without, i, j);
            others += std::abs(a[0] - b[0]) > 40;
        }
    EXPECT_LT(others, view.width * view.height / 100);
}

TEST(Render, LooksFromAboveAndIsTheSameForAnyNumberOfThreads)
{
    const Image many = render(subject(), from({0, -1, 0}));
    EXPECT_TRUE(isGrey(pixel(many, 80, 60)));
    const ThreadLimit one(1);
    EXPECT_EQ(render(subject(), from({0, -1, 0})).rgb, many.rgb);
}

TEST(Render, TornFacesHaveTheColourOfChoice)
{
    const tetmesh::DrawnTopology cube = tornCube();
    const auto middle = [&](const Paint& paint) {
        return pixel(render(subjectOf(cube, cube.mesh.points, paint), from({0, 0, -1})), 80, 60);
    };
    EXPECT_TRUE(isRed(middle({})));
    Paint paint;
    paint.torn.reset();
    EXPECT_TRUE(isGrey(middle(paint)));
    // As a run writes it: torn faces have a material of their own, which is red.
    tetmesh::DrawnTopology run = cube;
    run.mesh.materials = {"skin", "inside"};
    for (std::size_t f = 0; f < run.torn.size(); ++f) run.mesh.material[f] = run.torn[f];
    paint.materials = {{"skin", {0, .6, 0}}, {"inside", {.6, 0, 0}}};
    const auto green = pixel(render(subjectOf(run, run.mesh.points, paint), from({0, 0, -1})), 80, 60);
    EXPECT_GT(green[1], 2 * green[0]);
    // Or one that the scene has given a colour, unless another is chosen.
    run.mesh.materials[1] = "inside_skin";
    paint.materials = {{"skin", {.6, 0, 0}}, {"inside_skin", {0, .6, 0}}};
    paint.torn = Paint().torn;
    const auto own = pixel(render(subjectOf(run, run.mesh.points, paint), from({0, 0, -1})), 80, 60);
    EXPECT_GT(own[1], 2 * own[0]);
    paint.keepsOwnTorn = false;
    EXPECT_TRUE(isRed(pixel(render(subjectOf(run, run.mesh.points, paint), from({0, 0, -1})), 80, 60)));
    paint.torn = Colour(0, 0, .6f);
    const auto blue = middle(paint);
    EXPECT_GT(blue[2], 2 * blue[0]);
    EXPECT_GT(blue[2], 2 * blue[1]);
}

TEST(Render, ValuesOfPointsAreColoursBetweenThem)
{
    // Rises along x, so columns of the picture have one colour each; light is the same all over a face.
    Subject s = subject();
    std::vector<float> values;
    for (const Vec3& p : s.points) values.push_back(float(100 * p.x()));
    colourByValue(s, values, {0, 100, false});
    const Image picture = render(s, from({0, 0, -1}));
    Subject white = subject();
    std::fill(white.colour.begin(), white.colour.end(), Colour(1, 1, 1));
    const Image lit = render(white, from({0, 0, -1}));
    const auto linear = [](int byte) { return std::pow((byte / 255. + .055) / 1.055, 2.4); };
    // The face z = 1 spans this width of the picture.
    int left = 161, right = 0;
    for (int i = 0; i < 161; ++i)
        if (pixel(lit, i, 60) != pixel(render({}, from({0, 0, -1})), i, 60)) left = std::min(left, i), right = i;
    for (int i = left + 4; i < right - 3; i += 5) {
        const float x = float(i - left) / float(right - left);
        const Colour expected = (1 - x) * rampColour(0) + x * rampColour(1);
        for (int k = 0; k < 3; ++k) {
            const std::size_t c = std::size_t(k);
            // Gloss adds to both, and dark bytes are coarse.
            EXPECT_NEAR(linear(pixel(picture, i, 60)[c]) / linear(pixel(lit, i, 60)[c]), expected[k], .05) << i << k;
        }
    }
    values[s.triangles[0][1]] = -1;
    colourByValue(s, values, {0, 100, false});
    const Colour none = s.cornerColour[0][1];
    EXPECT_LT(none.maxCoeff() - none.minCoeff(), .02f);
    values.pop_back();
    EXPECT_THROW(colourByValue(s, values, {}), Error);
}

TEST(Render, ColoursGoWithTheRootWhereTheyShall)
{
    Subject s = subject();
    const std::vector<float> quarter(s.points.size(), 25);
    colourByValue(s, quarter, {0, 100, true});
    EXPECT_TRUE(s.cornerColour[0][0].isApprox(rampColour(.5)));
    colourByValue(s, quarter, {0, 100, false});
    EXPECT_TRUE(s.cornerColour[0][0].isApprox(rampColour(.25)));
    colourByValue(s, quarter, {10, 40, false});  // from the lowest on
    EXPECT_TRUE(s.cornerColour[0][0].isApprox(rampColour(.5)));
    const auto brightness = [](double t) { return (rampColour(t) * Colour(.2126f, .7152f, .0722f)).sum(); };
    for (double t = 0; t < .95; t += .1) EXPECT_GT(brightness(t + .1), brightness(t)) << t;
}

TEST(Render, ALegendShowsTheRampFromDarkToLightAndItsEnds)
{
    Image image{300, 200, std::vector<std::uint8_t>(3 * 300 * 200, 255)};
    drawLegend(image, {0, 8.5e3, false}, "energy [J/m^3]");
    std::vector<int> sums;  // along the bar
    for (int j = 199; j > 100 && sums.empty(); --j)
        if (pixel(image, 10, j)[2] > 100 && pixel(image, 10, j)[1] < 60)
            for (int i = 8; i < 108; ++i) sums.push_back(pixel(image, i, j)[0] + pixel(image, i, j)[1]);
    ASSERT_EQ(sums.size(), 100u);
    EXPECT_TRUE(std::is_sorted(sums.begin(), sums.end()));
    const auto ink = [&](int low, int high) {
        int count = 0;
        for (int j = low; j < high; ++j)
            for (int i = 0; i < 300; ++i) count += pixel(image, i, j) == std::array<int, 3>{30, 31, 33};
        return count;
    };
    EXPECT_GT(ink(0, 185), 100);   // what it is of
    EXPECT_GT(ink(180, 200), 60);  // 0 and 8.5e+03
    Image small{4, 3, std::vector<std::uint8_t>(36, 255)};
    EXPECT_NO_THROW(drawLegend(small, {0, 1, true}, "margin"));  // cut off, not written beside
}

TEST(Render, RefusesWhatCannotBeSeen)
{
    Subject s = subject();
    s.points[0].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(render(s, from({0, 0, 1})), Error);
    s = subject();
    s.triangles[0][0] = 8;
    EXPECT_THROW(render(s, from({0, 0, 1})), Error);
    View view = from({0, 0, 1});
    view.samples = 0;
    EXPECT_THROW(render(subject(), view), Error);
}

TEST(PngFile, PictureSurvivesWritingAndReading)
{
    const auto file = std::filesystem::temp_directory_path() / ("vdbfrac-" + std::to_string(::getpid()) + ".png");
    Image image{5, 3, {}};
    for (int i = 0; i < 45; ++i) image.rgb.push_back(std::uint8_t(i * 5));
    writePng(file, image);
    const Image back = readPng(file);
    EXPECT_EQ(back.width, 5);
    EXPECT_EQ(back.height, 3);
    EXPECT_EQ(back.rgb, image.rgb);
    const std::string bytes = readText(file);
    writeText(file, bytes.substr(0, bytes.size() / 2));
    EXPECT_THROW(readPng(file), FileError);
    EXPECT_THROW(writePng(file, Image{}), FileError);
    std::filesystem::remove(file);
}

TEST(PngFile, ContactSheetPlacesPicturesInRows)
{
    const Image black{2, 2, std::vector<std::uint8_t>(12, 0)};
    const Image sheet = contactSheet({black, black, black}, 2, 1);
    EXPECT_EQ(sheet.width, 7);
    EXPECT_EQ(sheet.height, 7);
    EXPECT_EQ(pixel(sheet, 0, 0)[0], 255);
    EXPECT_EQ(pixel(sheet, 1, 1)[0], 0);
    EXPECT_EQ(pixel(sheet, 5, 2)[0], 0);
    EXPECT_EQ(pixel(sheet, 1, 4)[0], 0);
    EXPECT_EQ(pixel(sheet, 4, 4)[0], 255);
    EXPECT_EQ(contactSheet({}, 2, 1).width, 0);
}
