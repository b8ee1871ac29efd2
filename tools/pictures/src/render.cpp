#include <vdbfrac/pictures/render.h>

#include "screen.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/pictures/texture.h>

#include <embree3/rtcore.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

namespace vdbfrac::pictures {

namespace {

const Colour kSkyTop(0.70f, 0.74f, 0.80f), kSkyBottom(0.42f, 0.44f, 0.47f), kGround(0.34f, 0.35f, 0.36f);
const Colour kSun(1.05f, 1.01f, 0.94f), kSkyLight(0.46f, 0.49f, 0.53f);
constexpr double kSunSize = 0.06;  // radius over distance: how soft shadows are
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Triangles that rays can hit.
class Target {
public:
    explicit Target(const Subject& subject) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_))
    {
        if (subject.triangles.empty()) {
            rtcCommitScene(scene_);
            return;
        }
        RTCGeometry mesh = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                   3 * sizeof(float), subject.points.size()));
        for (const Vec3& p : subject.points)
            for (int k = 0; k < 3; ++k) *points++ = float(p[k]);
        auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                       3 * sizeof(unsigned), subject.triangles.size()));
        for (const auto& t : subject.triangles)
            for (std::uint32_t c : t) *corners++ = c;
        rtcCommitGeometry(mesh);
        rtcAttachGeometry(scene_, mesh);
        rtcReleaseGeometry(mesh);
        rtcCommitScene(scene_);
    }
    ~Target()
    {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    Target(const Target&) = delete;
    Target& operator=(const Target&) = delete;

    struct Hit {
        double distance = -1;
        std::uint32_t triangle = 0;
        float u = 0, v = 0;
    };
    Hit hit(const Vec3& from, const Vec3& direction) const
    {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit ray{};
        ray.ray = rayOf(from, direction);
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context, &ray);
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
        return {double(ray.ray.tfar), ray.hit.primID, ray.hit.u, ray.hit.v};
    }
    bool isBlocked(const Vec3& from, const Vec3& direction) const
    {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRay ray = rayOf(from, direction);
        rtcOccluded1(scene_, &context, &ray);
        return ray.tfar < 0;
    }

private:
    static RTCRay rayOf(const Vec3& from, const Vec3& direction)
    {
        RTCRay ray{};
        ray.org_x = float(from.x()), ray.org_y = float(from.y()), ray.org_z = float(from.z());
        ray.dir_x = float(direction.x()), ray.dir_y = float(direction.y()), ray.dir_z = float(direction.z());
        ray.tfar = kInfinity;
        ray.mask = ~0u;
        return ray;
    }
    RTCDevice device_;
    RTCScene scene_;
};

/// Points of the unit square that fill it evenly, of a pixel that is shifted by its own amount (R2 sequence: Roberts
/// 2018).
struct Samples {
    double shiftU = 0, shiftV = 0;
    Samples(int i, int j, int set)
    {
        const auto mixed = [&](std::uint32_t z) {
            z += std::uint32_t(i) * 0x9e3779b1u + std::uint32_t(j) * 0x85ebca77u + std::uint32_t(set) * 0xc2b2ae3du;
            z = (z ^ z >> 15) * 0x2c1b3c6du, z = (z ^ z >> 12) * 0x297a2d39u;
            return double(z ^ z >> 15) / 4294967296.;
        };
        shiftU = mixed(1), shiftV = mixed(0x68bc21ebu);
    }
    std::array<double, 2> operator()(int n) const
    {
        return {std::fmod(shiftU + n * 0.7548776662466927, 1.), std::fmod(shiftV + n * 0.5698402909980532, 1.)};
    }
};

struct Surface {
    Vec3 X, normal, face;  // shading normal, and that of the triangle; both towards the eye
    Colour colour;
    double distance = 0;  // m, from the eye
};

class Tracer {
public:
    Tracer(const Subject& subject, const View& view) : subject_(subject), view_(view), target_(subject)
    {
        ahead_ = view.camera.direction.normalized();
        right_ = ahead_.cross(Vec3::UnitY()).norm() > 1e-6 ? Vec3(ahead_.cross(Vec3::UnitY()).normalized())
                                                           : Vec3(Vec3::UnitX());
        up_ = right_.cross(ahead_);
        slope_ = 2 * std::tan(view.camera.angle * std::numbers::pi / 360) / std::max(view.width, view.height);
        // From the upper left behind the camera.
        sun_ = (-0.9 * right_ + 1.5 * Vec3::UnitY() - 0.8 * ahead_).normalized();
        sunU_ = sun_.unitOrthogonal(), sunV_ = sun_.cross(sunU_);
    }

    Colour pixel(int i, int j) const
    {
        Colour sum = Colour::Zero();
        const Samples place(i, j, 0), sun(i, j, 1), sky(i, j, 2);
        for (int s = 0; s < view_.samples; ++s) {
            const auto at = place(s);
            const double x = (i + at[0] - 0.5 * view_.width) * slope_, y = (0.5 * view_.height - j - at[1]) * slope_;
            const Vec3 direction = (ahead_ + x * right_ + y * up_).normalized();
            const std::optional<Surface> seen = surfaceAt(view_.camera.eye, direction);
            sum += (seen ? light(*seen, direction, sun(s), sky(s)) : background(j + at[1])).min(1.5f);
        }
        return sum / float(view_.samples);
    }

private:
    Colour background(double row) const
    {
        const float t = float(row / view_.height);
        return (1 - t) * kSkyTop + t * kSkyBottom;
    }

    std::optional<Surface> surfaceAt(const Vec3& eye, const Vec3& direction) const
    {
        const Target::Hit hit = target_.hit(eye, direction);
        std::optional<Surface> flat = flatAt(eye, direction);
        if (flat && (hit.distance < 0 || flat->distance < hit.distance)) return flat;
        if (hit.distance < 0) return std::nullopt;
        const auto& t = subject_.triangles[hit.triangle];
        const auto& n = subject_.normals[hit.triangle];
        Surface s;
        s.X = eye + hit.distance * direction, s.distance = hit.distance;
        s.face = (subject_.points[t[1]] - subject_.points[t[0]])
                     .cross(subject_.points[t[2]] - subject_.points[t[0]])
                     .stableNormalized();
        if (s.face.dot(direction) > 0) s.face = -s.face;
        s.normal = ((1 - hit.u - hit.v) * n[0] + double(hit.u) * n[1] + double(hit.v) * n[2]).stableNormalized();
        if (s.normal.dot(s.face) < 0) s.normal = -s.normal;
        s.colour = subject_.colour[hit.triangle];
        if (hit.triangle < subject_.cornerColour.size()) {
            const auto& c = subject_.cornerColour[hit.triangle];
            s.colour = (1 - hit.u - hit.v) * c[0] + hit.u * c[1] + hit.v * c[2];
        }
        s.colour *= textureAt(hit);
        return s;
    }

    /// The nearest of the ground and the backdrops.
    std::optional<Surface> flatAt(const Vec3& eye, const Vec3& direction) const
    {
        std::optional<Surface> nearest;
        const auto take = [&](const Vec3& middle, const Vec3& front, const Colour& colour, auto&& isOn) {
            const double facing = front.dot(direction);
            const double distance = facing < 0 ? front.dot(middle - eye) / facing : -1;
            const Vec3 X = eye + distance * direction;
            if (distance > 0 && (!nearest || distance < nearest->distance) && isOn(X))
                nearest = Surface{X, front, front, colour, distance};
        };
        // The floor ends in the background, far from what is on it.
        if (view_.ground) take({0, *view_.ground, 0}, Vec3::UnitY(), kGround, [](const Vec3&) { return true; });
        for (const Subject::Backdrop& b : subject_.backdrops)
            take(b.center, b.toSide.cross(b.toTop).normalized(), b.colour, [&](const Vec3& X) {
                return std::abs((X - b.center).dot(b.toSide)) <= b.toSide.squaredNorm() &&
                       std::abs((X - b.center).dot(b.toTop)) <= b.toTop.squaredNorm();
            });
        return nearest;
    }

    Colour textureAt(const Target::Hit& hit) const
    {
        using Textured = Subject::Textured;
        const Textured of = hit.triangle < subject_.textured.size() ? subject_.textured[hit.triangle] : Textured();
        if (of.texture == Textured::kNone) return Colour::Ones();
        const Eigen::Array2f uv = (1 - hit.u - hit.v) * of.uv[0] + hit.u * of.uv[1] + hit.v * of.uv[2];
        return textureColour(*subject_.textures[of.texture], double(uv[0]), double(uv[1]));
    }

    Colour light(const Surface& s, const Vec3& direction, const std::array<double, 2>& sun,
                 const std::array<double, 2>& sky) const
    {
        // Off the face, by what is seen of it: things far away may be any size.
        const Vec3 from = s.X + 1e-4 * std::min(own_.size, s.distance) * s.face;
        const double r = kSunSize * std::sqrt(sun[0]), a = 2 * std::numbers::pi * sun[1];
        const Vec3 toSun = (sun_ + r * std::cos(a) * sunU_ + r * std::sin(a) * sunV_).normalized();
        Colour sum = Colour::Zero();
        if (const double facing = s.normal.dot(toSun); facing > 0 && !target_.isBlocked(from, toSun)) {
            const Vec3 half = (toSun - direction).normalized();
            const double gloss = 0.06 * std::pow(std::max(0., half.dot(s.normal)), 40.);
            sum += kSun * (float(facing) * s.colour + float(gloss));
        }
        // Skylight from a direction above the surface, more often from where it faces.
        const Vec3 u = s.normal.unitOrthogonal(), v = s.normal.cross(u);
        const double rho = std::sqrt(sky[0]), b = 2 * std::numbers::pi * sky[1];
        const Vec3 up = rho * std::cos(b) * u + rho * std::sin(b) * v + std::sqrt(1 - sky[0]) * s.normal;
        if (!target_.isBlocked(from, up)) sum += kSkyLight * s.colour * float(0.65 + 0.35 * up.y());
        if (s.normal != Vec3::UnitY() || !view_.ground || s.X.y() > *view_.ground + 1e-9 * own_.size) return sum;
        const double away = (s.X - stage_.middle).norm() / (3 * stage_.size);
        const float fade = float(std::clamp(away - 0.4, 0., 1.));
        return (1 - fade) * sum + fade * kSkyBottom;
    }

    const Subject& subject_;
    const View& view_;
    Target target_;
    Vec3 ahead_, right_, up_, sun_, sunU_, sunV_;
    Stage own_{subject_.points}, stage_ = view_.stage.value_or(own_);
    double slope_ = 0;
};

void check(const Subject& subject, const View& view)
{
    if (view.width < 1 || view.height < 1 || view.samples < 1 || !(view.camera.direction.norm() > 0) ||
        !view.camera.eye.allFinite())
        throw Error("a picture needs a size, a place and a direction to look from");
    for (const Vec3& p : subject.points)
        if (!p.allFinite()) throw Error("a surface with a point that is not finite");
    for (const auto& t : subject.triangles)
        for (std::uint32_t c : t)
            if (c >= subject.points.size()) throw Error("a face has a corner without a point");
    for (const auto& t : subject.textured)
        if (t.texture != Subject::Textured::kNone &&
            (t.texture >= subject.textures.size() || !subject.textures[t.texture]))
            throw Error("a face has a texture that is not there");
}

}  // namespace

Image render(const Subject& subject, const View& view)
{
    check(subject, view);
    const Tracer tracer(subject, view);
    Image image{view.width, view.height, std::vector<std::uint8_t>(3 * std::size_t(view.width * view.height))};
    parallelChunks(std::size_t(view.height), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
            for (int i = 0; i < view.width; ++i) {
                const Colour colour = tracer.pixel(i, int(j));
                std::uint8_t* rgb = &image.rgb[3 * (j * std::size_t(view.width) + std::size_t(i))];
                for (int c = 0; c < 3; ++c) rgb[c] = byteOf(colour[c]);
            }
    });
    return image;
}

}  // namespace vdbfrac::pictures
