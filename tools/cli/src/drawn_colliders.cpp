#include "drawn_colliders.h"

#include <vdbfrac/core/drawing.h>
#include <vdbfrac/scene/placement.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <variant>

namespace vdbfrac::cli {

namespace {

const pictures::Colour kSteel(0.22f, 0.26f, 0.30f);

bool standsStill(const scene::Collider& collider)
{
    if (const auto* const path = std::get_if<scene::Velocity>(&collider.move)) return path->velocity.isZero();
    const std::vector<scene::PoseKey>& keys = std::get<scene::Keys>(collider.move).keys;
    return std::all_of(keys.begin(), keys.end(),
                       [](const scene::PoseKey& k) { return k.translate.isZero() && k.rotate.isZero(); });
}

pictures::Subject steel(const tetmesh::RenderMesh& mesh)
{
    tetmesh::DrawnTopology drawn{mesh, std::vector<std::uint32_t>(mesh.faces(), 0),
                                 std::vector<std::uint8_t>(mesh.faces(), 0)};
    pictures::Subject subject = pictures::subjectOf(drawn, mesh.points);
    std::fill(subject.colour.begin(), subject.colour.end(), kSteel);
    return subject;
}

/// A square of the plane of a halfspace below or beside all points.
pictures::Subject::Backdrop square(const Primitive& halfspace, std::span<const Vec3> points, const Vec3& origin)
{
    constexpr double kLarge = 4;  // of what is in the picture
    Vec3 lower = points[0], upper = points[0];
    for (const Vec3& p : points) lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
    const Vec3 n = halfspace.axis, all = 0.5 * (lower + upper) + origin;
    const Vec3 center = all - (n.dot(all) - halfspace.offset) * n;
    const Vec3 u = kLarge * (upper - lower).norm() * n.unitOrthogonal();
    return {center, u, u.cross(n), kSteel};
}

}  // namespace

DrawnColliders::DrawnColliders(const scene::Scene& scene)
{
    for (const scene::Collider& c : scene.colliders) {
        const auto* const solid = std::get_if<Primitive>(&c.shape);
        if (solid && solid->kind == Primitive::Kind::halfspace && solid->axis == -Vec3::UnitY() && standsStill(c)) {
            floor_ = std::max(floor_.value_or(-solid->offset), -solid->offset);
            continue;
        }
        drawn_.push_back({&c, steel(core::surfaceOf(c, scene.grid))});
    }
}

std::optional<double> DrawnColliders::lowest(std::span<const double> times) const
{
    std::optional<double> lowest;
    for (const Drawn& d : drawn_) {
        const auto* const solid = std::get_if<Primitive>(&d.collider->shape);
        if (solid && solid->kind == Primitive::Kind::cylinder && solid->height == 0) continue;
        for (const double time :
             standsStill(*d.collider) ? times.first(std::min<std::size_t>(1, times.size())) : times) {
            const scene::Placement place = scene::placementAt(d.collider->move, time);
            for (const Vec3& p : d.surface.points) lowest = std::min(place(p).y(), lowest.value_or(place(p).y()));
        }
    }
    return lowest;
}

void DrawnColliders::addTo(pictures::Subject& subject, double time, const Vec3& origin) const
{
    if (subject.points.empty()) return;
    const std::vector<Vec3> seen = subject.points;
    for (const Drawn& d : drawn_) {
        const scene::Placement place = scene::placementAt(d.collider->move, time);
        const auto* const solid = std::get_if<Primitive>(&d.collider->shape);
        if (solid && solid->kind == Primitive::Kind::halfspace) {
            Primitive moved = *solid;
            moved.axis = place.turn * solid->axis;
            moved.offset = moved.axis.dot(place(solid->offset * solid->axis));
            pictures::Subject::Backdrop at = square(moved, seen, origin);
            at.center -= origin;
            subject.backdrops.push_back(at);
            continue;
        }
        const pictures::Subject& own = d.surface;
        const std::uint32_t first = std::uint32_t(subject.points.size());
        for (const Vec3& p : own.points) subject.points.push_back(place(p) - origin);
        for (auto t : own.triangles) subject.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
        for (const auto& n : own.normals)
            subject.normals.push_back({place.turn * n[0], place.turn * n[1], place.turn * n[2]});
        subject.colour.insert(subject.colour.end(), own.colour.begin(), own.colour.end());
    }
}

}  // namespace vdbfrac::cli
