#include <vdbfrac/base/error.h>
#include <vdbfrac/pictures/render.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace vdbfrac::pictures {

namespace {

constexpr double kCrease = 40;  // degrees
const Colour kOutside(0.53f, 0.50f, 0.45f);

/// Colours that differ for numbers that are near each other: hues apart by the golden angle.
Colour hueOf(std::uint32_t number)
{
    const float hue = 6 * std::fmod(0.08f + float(number % 1024) * 0.618034f, 1.f);
    const auto part = [&](float shift) {
        const float t = std::fmod(hue + shift, 6.f);
        return 0.12f + 0.5f * std::clamp(std::abs(t - 3) - 1, 0.f, 1.f);
    };
    return {part(0), part(4), part(2)};
}

/// The colour of a face's material.
Colour materialColour(const tetmesh::RenderMesh& mesh, std::size_t face, const MaterialColours& materials)
{
    if (mesh.material[face] == tetmesh::RenderMesh::kNone) return kOutside;
    const auto found = materials.find(mesh.materials[mesh.material[face]]);
    if (found == materials.end()) return kOutside;
    constexpr float kGamma = 2.2f;  // of .mtl files, which tell what a screen shows
    return found->second.cast<float>().array().max(0.f).pow(kGamma);
}

}  // namespace

Subject subjectOf(const tetmesh::DrawnTopology& drawn, std::span<const Vec3> points, const Paint& paint)
{
    tetmesh::RenderMesh mesh = drawn.mesh;
    mesh.points.assign(points.begin(), points.end());
    for (const auto& c : mesh.corners)
        if (c.point >= points.size()) throw Error("a face has a corner without a point");
    const bool given = std::all_of(mesh.corners.begin(), mesh.corners.end(),
                                   [&](const auto& c) { return c.normal < mesh.normals.size(); });
    if (!given || mesh.corners.empty()) tetmesh::setNormals(mesh, kCrease);
    Subject subject;
    subject.points = mesh.points;
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    for (std::size_t t = 0; t < fans.face.size(); ++t) {
        const auto& c = fans.corners[t];
        const auto at = [&](std::size_t k) -> const tetmesh::RenderMesh::Corner& { return mesh.corners[c[k]]; };
        subject.triangles.push_back({at(0).point, at(1).point, at(2).point});
        subject.normals.push_back({mesh.normals[at(0).normal], mesh.normals[at(1).normal], mesh.normals[at(2).normal]});
        const std::uint32_t f = fans.face[t];
        const Colour outside =
            paint.by == ColourBy::fragment ? hueOf(drawn.fragment[f]) : materialColour(mesh, f, paint.materials);
        subject.colour.push_back(drawn.torn[f] && paint.torn ? *paint.torn : outside);
    }
    return subject;
}

Camera fittingCamera(const Vec3& direction, std::span<const Vec3> points, int width, int height, double angle)
{
    constexpr double kMargin = 0.06;  // of the picture on each side
    Camera camera;
    camera.angle = angle;
    camera.direction = direction.normalized();
    const Vec3 ahead = camera.direction;
    const Vec3 right =
        ahead.cross(Vec3::UnitY()).norm() > 1e-6 ? Vec3(ahead.cross(Vec3::UnitY()).normalized()) : Vec3(Vec3::UnitX());
    const Vec3 up = right.cross(ahead);
    const double longer = std::tan(camera.angle * std::acos(-1.) / 360) * (1 - 2 * kMargin);
    const Eigen::Vector2d slope(longer * width / std::max(width, height), longer * height / std::max(width, height));
    // Each side of the picture is a plane through the eye that holds the points on its inner side.
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
    for (const Vec3& p : points) {
        const double along = ahead.dot(p);
        const Eigen::Vector2d across(right.dot(p), up.dot(p));
        low = low.cwiseMin(across + along * slope), high = high.cwiseMax(across - along * slope);
    }
    // high - e <= -s along_e and low - e >= s along_e, for e across and along_e of the eye.
    double along = 1e300;
    for (int k = 0; k < 2; ++k) along = std::min(along, (low[k] - high[k]) / (2 * slope[k]));
    if (points.empty()) low = high = Eigen::Vector2d::Zero(), along = -1;
    const Eigen::Vector2d middle = 0.5 * (low + high);
    camera.eye = along * ahead + middle[0] * right + middle[1] * up;
    return camera;
}

}  // namespace vdbfrac::pictures
