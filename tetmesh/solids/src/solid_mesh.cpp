#include <vdbfrac/solids/solid_mesh.h>

#include "booleans.h"
#include "solid_shapes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace vdbfrac::solids {

namespace {

using tetmesh::RenderMesh;
using Corner = RenderMesh::Corner;
constexpr std::uint32_t kNone = RenderMesh::kNone;

Bounds joined(const Bounds& a, const Bounds& b) { return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)}; }

/// A box round what a body is, and what is added to it.
Bounds boundsWith(Bounds body, const Carving& how)
{
    for (const Primitive& p : how.add) body = joined(body, bounds(p));
    return body;
}

/// Solids without end are cut off outside of `within`.
std::optional<Parts> carvedBy(const Parts& whole, const Carving& how, const Bounds& within, double edge)
{
    const auto surfaces = [&](std::span<const Primitive> solids) {
        std::vector<Triangles> all;
        for (const Primitive& p : solids) all.push_back(trianglesOf(p, edge, within));
        return all;
    };
    return carved(whole, surfaces(how.add), surfaces(how.cut), edge);
}

/// The solid on whose surface a triangle with these corners lies: it is near, and looks the same way.
std::uint32_t solidOf(const std::array<Vec3, 3>& corners, std::span<const Primitive> solids)
{
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const double size = std::sqrt(area.norm());
    const auto alike = std::ranges::min_element(solids, {}, [&](const Primitive& p) {
        const double along = std::abs(area.stableNormalized().dot(distanceGradient(p, middle)));
        return std::abs(signedDistance(p, middle)) + size * (1 - along);
    });
    return std::uint32_t(alike - solids.begin());
}

/// With normals that are smooth between edges, which are between any two solids too where these are given.
RenderMesh renderMeshOf(const std::vector<Vec3>& points, std::span<const std::array<std::uint32_t, 3>> triangles,
                        std::span<const Primitive> solids = {})
{
    RenderMesh mesh;
    mesh.points = points;
    std::vector<std::uint32_t> solid;
    for (const auto& t : triangles) {
        mesh.addFace(std::array<Corner, 3>{{{t[0]}, {t[1]}, {t[2]}}}, kNone, kNone);
        if (!solids.empty()) solid.push_back(solidOf({points[t[0]], points[t[1]], points[t[2]]}, solids));
    }
    tetmesh::setNormals(mesh, kCrease, solid);
    return mesh;
}

/// A mesh as triangles, and what is left of these as a mesh with all that it carries.
class Carver {
public:
    Carver(const RenderMesh& mesh, double edge) : mesh_(mesh), fans_(tetmesh::fansOf(mesh)), edge_(edge)
    {
        for (std::uint32_t p = 0; p < mesh.points.size(); ++p)
            joined_.push_back(firstAt_.emplace(keyOf(mesh.points[p]), p).first->second);
    }

    /// All triangles, with equal points joined.
    Parts whole() const
    {
        Parts parts;
        std::vector<std::uint32_t> number(mesh_.points.size(), kNone);
        for (std::uint32_t t = 0; t < fans_.corners.size(); ++t) {
            std::array<std::uint32_t, 3> corner{};
            for (std::size_t k = 0; k < 3; ++k) corner[k] = joined_[given(t, k).point];
            if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
            for (std::uint32_t& c : corner) {
                if (number[c] == kNone) {
                    number[c] = std::uint32_t(parts.surface.points.size());
                    parts.surface.points.push_back(mesh_.points[c]);
                }
                c = number[c];
            }
            parts.surface.triangles.push_back(corner);
            parts.origin.push_back(t);
        }
        return parts;
    }

    /// Faces that nothing is missing of, parts of others, then what is part of none.
    RenderMesh left(const Parts& parts)
    {
        now_ = mesh_;
        now_.corners.clear(), now_.faceEnd.clear(), now_.group.clear(), now_.material.clear();
        std::vector<std::array<std::uint32_t, 3>> made;
        std::vector<std::vector<std::array<std::uint32_t, 3>>> ofTriangle(fans_.corners.size());
        const std::vector<std::uint32_t> number = numbered(parts.surface.points);
        for (std::size_t i = 0; i < parts.origin.size(); ++i) {
            std::array<std::uint32_t, 3> t = parts.surface.triangles[i];
            for (std::uint32_t& p : t) p = number[p];
            (parts.origin[i] == kNone ? made : ofTriangle[parts.origin[i]]).push_back(t);
        }
        for (std::uint32_t t = 0, end = 0; t < fans_.face.size(); t = end) {
            const std::uint32_t f = fans_.face[t];
            bool whole = true;
            for (end = t; end < fans_.face.size() && fans_.face[end] == f; ++end)
                whole = whole && isWhole(end, ofTriangle[end]);
            if (whole) now_.addFace(mesh_.face(f), mesh_.group[f], mesh_.material[f]);
            for (std::uint32_t i = t; i < end && !whole; ++i) addParts(i, ofTriangle[i]);
        }
        addMade(made);
        return std::move(now_);
    }

private:
    using Key = std::array<double, 3>;

    Key keyOf(const Vec3& X) const
    {
        const Vec3 r = rounded(X, edge_);
        return {r.x(), r.y(), r.z()};
    }
    Corner given(std::uint32_t triangle, std::size_t k) const { return mesh_.corners[fans_.corners[triangle][k]]; }

    /// Numbers of points in the mesh, which gets those that it does not have.
    std::vector<std::uint32_t> numbered(const std::vector<Vec3>& points)
    {
        std::vector<std::uint32_t> number;
        for (const Vec3& X : points) {
            const auto known = firstAt_.find(keyOf(X));
            number.push_back(known != firstAt_.end() ? known->second : std::uint32_t(now_.points.size()));
            if (known == firstAt_.end()) now_.points.push_back(X);
        }
        return number;
    }
    /// The corner of a triangle that is at a point, or at one in its place.
    std::optional<Corner> givenAt(std::uint32_t triangle, std::uint32_t point) const
    {
        for (std::size_t k = 0; k < 3; ++k)
            if (const Corner c = given(triangle, k); joined_[c.point] == point) return c;
        return std::nullopt;
    }
    bool isWhole(std::uint32_t triangle, std::span<const std::array<std::uint32_t, 3>> parts) const
    {
        return parts.size() == 1 &&
               std::ranges::all_of(parts[0], [&](std::uint32_t p) { return givenAt(triangle, p).has_value(); });
    }
    void addParts(std::uint32_t triangle, std::span<const std::array<std::uint32_t, 3>> parts)
    {
        tetmesh::PartCorners corners(now_, {given(triangle, 0), given(triangle, 1), given(triangle, 2)});
        for (const auto& part : parts) {
            std::array<Corner, 3> own;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::optional<Corner> at = givenAt(triangle, part[k]);
                own[k] = at ? *at : corners.at(part[k]);
            }
            const std::uint32_t f = fans_.face[triangle];
            now_.addFace(own, mesh_.group[f], mesh_.material[f]);
        }
    }
    void addMade(std::span<const std::array<std::uint32_t, 3>> triangles)
    {
        const RenderMesh made = renderMeshOf(now_.points, triangles);
        const bool hasNormals = !mesh_.normals.empty();
        const std::uint32_t first = std::uint32_t(now_.normals.size());
        if (hasNormals) now_.normals.insert(now_.normals.end(), made.normals.begin(), made.normals.end());
        for (std::size_t f = 0; f < made.faces(); ++f) {
            std::array<Corner, 3> own;
            std::ranges::copy(made.face(f), own.begin());
            for (Corner& c : own) c.normal = hasNormals ? first + c.normal : kNone;
            now_.addFace(own, kNone, kNone);
        }
    }

    const RenderMesh& mesh_;
    tetmesh::Fans fans_;
    double edge_;
    std::map<Key, std::uint32_t> firstAt_;  // the first point at a place
    std::vector<std::uint32_t> joined_;     // of each point: the first at its place
    RenderMesh now_;
};

}  // namespace

std::optional<RenderMesh> solidMesh(const Primitive& solid, const Carving& how, double edge)
{
    const Bounds within = boundsWith(bounds(solid), how);
    Parts parts{trianglesOf(solid, edge, within), {}};
    parts.origin.assign(parts.surface.triangles.size(), Parts::kNone);
    if (!how.add.empty() || !how.cut.empty()) {
        std::optional<Parts> left = carvedBy(parts, how, within, edge);
        if (!left) return std::nullopt;
        parts = std::move(*left);
    }
    std::vector<Primitive> all = {solid};
    all.insert(all.end(), how.add.begin(), how.add.end());
    all.insert(all.end(), how.cut.begin(), how.cut.end());
    return renderMeshOf(parts.surface.points, parts.surface.triangles, all);
}

std::optional<RenderMesh> carvedMesh(const RenderMesh& mesh, const Carving& how, double edge)
{
    if (mesh.points.empty()) return std::nullopt;
    Carver carver(mesh, edge);
    Bounds within{mesh.points[0], mesh.points[0]};
    for (const Vec3& X : mesh.points) within = joined(within, {X, X});
    const std::optional<Parts> left = carvedBy(carver.whole(), how, boundsWith(within, how), edge);
    if (!left) return std::nullopt;
    return carver.left(*left);
}

UnitedMesh unitedMesh(const RenderMesh& mesh, double edge)
{
    Carver carver(mesh, edge);
    const United united = vdbfrac::solids::united(carver.whole(), edge);
    if (!united.parts) return {united.shells, std::nullopt};
    return {united.shells, carver.left(*united.parts)};
}

}  // namespace vdbfrac::solids
