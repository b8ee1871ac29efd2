#include <vdbfrac/base/error.h>
#include <vdbfrac/pictures/render.h>
#include <vdbfrac/tetmesh/mtl_file.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>

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

/// The colour of a material; kNone is one without name.
Colour materialColour(const tetmesh::RenderMesh& mesh, std::uint32_t material, const Paint& paint)
{
    if (material == tetmesh::RenderMesh::kNone) return kOutside;
    const std::string& name = mesh.materials[material];
    const auto found = paint.materials.find(name);
    if (found == paint.materials.end()) return paint.textures.contains(name) ? Colour(Colour::Ones()) : kOutside;
    return tetmesh::lightOf(found->second).cast<float>();
}

/// Of torn faces of a material.
Colour tornColour(const tetmesh::RenderMesh& mesh, std::uint32_t material, const Paint& paint)
{
    const bool isNamed = material != tetmesh::RenderMesh::kNone && tetmesh::isTornMaterial(mesh.materials[material]) &&
                         mesh.materials[material] != mesh.torn;
    return isNamed && paint.keepsOwnTorn ? materialColour(mesh, material, paint) : *paint.torn;
}

/// Of each fragment the material that most of its faces have which are not torn.
std::map<std::uint32_t, std::uint32_t> materialsOf(const tetmesh::DrawnTopology& drawn)
{
    std::map<std::uint32_t, std::map<std::uint32_t, std::size_t>> faces;
    for (std::size_t f = 0; f < drawn.fragment.size(); ++f)
        if (!drawn.torn[f]) ++faces[drawn.fragment[f]][drawn.mesh.material[f]];
    std::map<std::uint32_t, std::uint32_t> most;
    for (const auto& [fragment, counts] : faces)
        most[fragment] = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                             return a.second < b.second;
                         })->first;
    return most;
}

/// Textures of the triangles of fans.
class Texturing {
public:
    Texturing(const tetmesh::DrawnTopology& drawn, const Paint& paint, Subject& subject)
        : drawn_(drawn), subject_(subject)
    {
        if (paint.by != ColourBy::material || paint.textures.empty()) return;
        for (const std::string& name : drawn.mesh.materials) {
            const auto found = paint.textures.find(name);
            ofMaterial_.push_back(found == paint.textures.end() ? nullptr : &found->second);
            subject.textures.push_back(ofMaterial_.back() ? ofMaterial_.back()->image : nullptr);
        }
    }

    /// Of the next triangle, of three places in the corners of the mesh.
    void add(std::uint32_t face, const std::array<std::uint32_t, 3>& corners)
    {
        if (ofMaterial_.empty()) return;
        Subject::Textured& textured = subject_.textured.emplace_back();
        const tetmesh::RenderMesh& mesh = drawn_.mesh;
        const std::uint32_t material = mesh.material[face];
        if (drawn_.torn[face] || material == tetmesh::RenderMesh::kNone || !ofMaterial_[material]) return;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t uv = mesh.corners[corners[k]].uv;
            if (uv >= mesh.uvs.size()) return;
            textured.uv[k] = ofMaterial_[material]->scale * mesh.uvs[uv].head<2>().cast<float>().array() +
                             ofMaterial_[material]->offset;
        }
        textured.texture = material;
    }

private:
    const tetmesh::DrawnTopology& drawn_;
    Subject& subject_;
    std::vector<const MaterialTexture*> ofMaterial_;  // none: nullptr
};

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
    Texturing texturing(drawn, paint, subject);
    const auto others = paint.torn ? std::map<std::uint32_t, std::uint32_t>() : materialsOf(drawn);
    const auto materialOf = [&](std::uint32_t f) {
        const auto of = drawn.torn[f] ? others.find(drawn.fragment[f]) : others.end();
        return of == others.end() ? mesh.material[f] : of->second;
    };
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    for (std::size_t t = 0; t < fans.face.size(); ++t) {
        const auto& c = fans.corners[t];
        const auto at = [&](std::size_t k) -> const tetmesh::RenderMesh::Corner& { return mesh.corners[c[k]]; };
        subject.triangles.push_back({at(0).point, at(1).point, at(2).point});
        subject.normals.push_back({mesh.normals[at(0).normal], mesh.normals[at(1).normal], mesh.normals[at(2).normal]});
        const std::uint32_t f = fans.face[t];
        if (drawn.torn[f] && paint.torn)
            subject.colour.push_back(tornColour(mesh, mesh.material[f], paint));
        else
            subject.colour.push_back(paint.by == ColourBy::fragment ? hueOf(drawn.fragment[f])
                                                                    : materialColour(mesh, materialOf(f), paint));
        texturing.add(f, c);
    }
    return subject;
}

Stage::Stage(std::span<const Vec3> points) : middle(points.empty() ? Vec3(Vec3::Zero()) : points[0])
{
    constexpr double kLeast = 1e-9;  // m
    size = kLeast;
    add(points);
}

void Stage::add(std::span<const Vec3> points)
{
    for (const Vec3& p : points) size = std::max(size, (p - middle).norm());
}

CameraFit::CameraFit(const Vec3& direction, int width, int height, double angle)
    : ahead_(direction.normalized()), low_(Eigen::Vector2d::Constant(1e300)), high_(-low_), angle_(angle)
{
    constexpr double kMargin = 0.06;  // of the picture on each side
    const Vec3 beside = ahead_.cross(Vec3::UnitY());
    right_ = beside.norm() > 1e-6 ? Vec3(beside.normalized()) : Vec3(Vec3::UnitX());
    up_ = right_.cross(ahead_);
    const double longer = std::tan(angle * std::acos(-1.) / 360) * (1 - 2 * kMargin);
    slope_ = Eigen::Vector2d(longer * width / std::max(width, height), longer * height / std::max(width, height));
}

/// Each side of the picture is a plane through the eye that holds the points on its inner side.
void CameraFit::add(std::span<const Vec3> points)
{
    for (const Vec3& p : points) {
        const double along = ahead_.dot(p);
        const Eigen::Vector2d across(right_.dot(p), up_.dot(p));
        low_ = low_.cwiseMin(across + along * slope_), high_ = high_.cwiseMax(across - along * slope_);
        isEmpty_ = false;
    }
}

Camera CameraFit::camera() const
{
    Camera camera;
    camera.angle = angle_, camera.direction = ahead_;
    // high - e <= -s along_e and low - e >= s along_e, for e across and along_e of the eye.
    double along = 1e300;
    for (int k = 0; k < 2; ++k) along = std::min(along, (low_[k] - high_[k]) / (2 * slope_[k]));
    const Eigen::Vector2d middle = 0.5 * (low_ + high_);
    camera.eye = isEmpty_ ? Vec3(-ahead_) : Vec3(along * ahead_ + middle[0] * right_ + middle[1] * up_);
    return camera;
}

Camera fittingCamera(const Vec3& direction, std::span<const Vec3> points, int width, int height, double angle)
{
    CameraFit fit(direction, width, height, angle);
    fit.add(points);
    return fit.camera();
}

}  // namespace vdbfrac::pictures
