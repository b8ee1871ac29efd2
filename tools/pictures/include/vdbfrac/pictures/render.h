// A picture of a surface, lit by a sun with a soft shadow and by the sky, on the ground. Needs no display.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::pictures {

struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, rows from the top
};

using Colour = Eigen::Array3f;  ///< linear red, green, blue in [0, 1]

/// What is looked at.
struct Subject {
    std::vector<Vec3> points;                             ///< m
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into points
    std::vector<std::array<Vec3, 3>> normals;             ///< of the corners of each triangle
    std::vector<Colour> colour;                           ///< of each triangle
    std::vector<std::array<Colour, 3>> cornerColour;      ///< of the first triangles, in place of theirs

    struct Textured {
        static constexpr std::uint32_t kNone = 0xffffffff;
        std::uint32_t texture = kNone;                                              ///< index into textures
        std::array<Eigen::Array2f, 3> uv = {Eigen::Array2f(0, 0), {0, 0}, {0, 0}};  ///< of the corners
    };
    std::vector<std::shared_ptr<const Image>> textures;
    std::vector<Textured> textured;  ///< of the first triangles: what their colour is multiplied by

    /// A flat wall, seen from in front only. It casts no shadow: where it stands between the light or the eye and the
    /// rest, that is seen as if it were not there.
    struct Backdrop {
        Vec3 center, toSide, toTop;  ///< m: the last two from the middle to the edges; toSide x toTop is in front
        Colour colour;
    };
    std::vector<Backdrop> backdrops;
};

/// How a surface is coloured.
enum class ColourBy { material, fragment };

/// Colours of materials, as .mtl files have them.
using MaterialColours = std::map<std::string, Vec3>;

/// A texture of a material: the point (u, v) of the surface has the texture's scale * (u, v) + offset.
struct MaterialTexture {
    std::shared_ptr<const Image> image;
    Eigen::Array2f scale = {1, 1}, offset = {0, 0};
};
using MaterialTextures = std::map<std::string, MaterialTexture>;

struct Paint {
    MaterialColours materials;
    MaterialTextures textures;  ///< of faces by their material that are not torn
    ColourBy by = ColourBy::material;
    std::optional<Colour> torn = Colour(0.62f, 0.035f, 0.025f);  ///< red; none: as other faces are
    bool keepsOwnTorn = true;  ///< torn faces whose body has a material for them show that
};

/// A frame: smooth between creases; faces by their material or their fragment, but for torn ones. Throws Error for
/// faces without points.
Subject subjectOf(const tetmesh::DrawnTopology& drawn, std::span<const Vec3> points, const Paint& paint = {});

/// What a screen shows for 0xrrggbb (sRGB).
Colour colourOnScreen(std::uint32_t rgb);
/// From dark over violet and orange to light, brighter and brighter; t in [0, 1].
Colour rampColour(double t);
/// How values become colours.
struct Scale {
    double low = 0, high = 1;  ///< the darkest and the brightest; what is below 0 has no value and is grey
    bool byRoot = false;       ///< colours go with the root of a value, as stress does with energy
};
/// Colours all corners by the values of their points, in place of textures.
void colourByValue(Subject& subject, std::span<const float> ofPoints, const Scale& scale);
/// The colours of the scale with its ends, and what it is of, into the lower left of a picture. Small letters, digits
/// and . + - / ^ ( ) are drawn, other characters are gaps.
void drawLegend(Image& image, const Scale& scale, const std::string& what);
/// Small letters in the upper left corner. Letters, digits and signs of numbers and keys; others are left blank.
void drawLabel(Image& image, const std::string& text);

struct Camera {
    Vec3 eye = Vec3::Zero();                 ///< m
    Vec3 direction = Vec3(-0.5, -0.35, -1);  ///< of looking
    double angle = 45;                       ///< degrees that the longer side of the picture shows
};
/// Finds the nearest place from which all points are seen, with a margin.
class CameraFit {
public:
    CameraFit(const Vec3& direction, int width, int height, double angle = 45);
    void add(std::span<const Vec3> points);
    Camera camera() const;

private:
    Vec3 ahead_, right_, up_;
    Eigen::Vector2d slope_, low_, high_;  // of the sides of the picture, and how far out points are along them
    double angle_;
    bool isEmpty_ = true;
};
Camera fittingCamera(const Vec3& direction, std::span<const Vec3> points, int width, int height, double angle = 45);

/// What is lit of an endless floor, before it fades.
struct Stage {
    Vec3 middle;
    double size = 0;  ///< m: from the middle to the farthest of what stands there

    /// Round some points.
    explicit Stage(std::span<const Vec3> points);
    void add(std::span<const Vec3> points);
};

struct View {
    Camera camera;
    int width = 640, height = 480;
    int samples = 32;              ///< rays a pixel
    std::optional<double> ground;  ///< height of a floor [m]
    std::optional<Stage> stage;    ///< the same for all pictures of a shot; none: round what is seen
};

/// The same picture for any number of threads. Throws Error for a view without size and values that are not finite.
Image render(const Subject& subject, const View& view);

}  // namespace vdbfrac::pictures
