#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/planar.h>

#include <vdbfrac/base/polygon.h>
#include <vdbfrac/base/triangle.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdbfrac::tetmesh {

void RenderMesh::addFace(std::span<const Corner> c, std::uint32_t g, std::uint32_t m)
{
    corners.insert(corners.end(), c.begin(), c.end());
    faceEnd.push_back(std::uint32_t(corners.size()));
    group.push_back(g);
    material.push_back(m);
}

Fans fansOf(const RenderMesh& mesh)
{
    Fans fans;
    fans.corners.reserve(mesh.faces()), fans.face.reserve(mesh.faces());
    std::vector<Vec3> corners;
    for (std::uint32_t f = 0; f < mesh.faces(); ++f) {
        corners.clear();
        for (const RenderMesh::Corner& c : mesh.face(f)) corners.push_back(mesh.points[c.point]);
        const std::uint32_t begin = f == 0 ? 0 : mesh.faceEnd[f - 1];
        eachTriangle(corners, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            fans.corners.push_back({begin + a, begin + b, begin + c});
            fans.face.push_back(f);
        });
    }
    return fans;
}

RenderMesh::Corner PartCorners::at(std::uint32_t point)
{
    for (const RenderMesh::Corner& c : triangle_)
        if (c.point == point) return c;
    for (const RenderMesh::Corner& c : made_)
        if (c.point == point) return c;
    return made_.emplace_back(between(point));
}

RenderMesh::Corner PartCorners::between(std::uint32_t point)
{
    using Corner = RenderMesh::Corner;
    const auto& [a, b, c] = triangle_;
    const Vec3 w = sharesOf({mesh_.points[a.point], mesh_.points[b.point], mesh_.points[c.point]}, mesh_.points[point]);
    const auto mean = [&](std::vector<Vec3>& values, std::uint32_t Corner::*which) {
        if (a.*which == RenderMesh::kNone || b.*which == RenderMesh::kNone || c.*which == RenderMesh::kNone)
            return RenderMesh::kNone;
        values.push_back(w[0] * values[a.*which] + w[1] * values[b.*which] + w[2] * values[c.*which]);
        return std::uint32_t(values.size() - 1);
    };
    Corner made{point, mean(mesh_.uvs, &Corner::uv), mean(mesh_.normals, &Corner::normal)};
    if (made.normal != RenderMesh::kNone) mesh_.normals.back().normalize();
    return made;
}

RenderMesh renderMesh(const PolygonSoup& soup)
{
    RenderMesh mesh;
    mesh.points = soup.points, mesh.uvs = soup.uvs, mesh.normals = soup.normals;
    const auto of = [](const std::vector<Vec3>& values, std::size_t p) {
        return values.empty() || !values[p].allFinite() ? RenderMesh::kNone : std::uint32_t(p);
    };
    const auto normalOf = [&](std::size_t p) {  // some programs write zeros
        return soup.normals.empty() || soup.normals[p].isZero() ? RenderMesh::kNone : of(soup.normals, p);
    };
    std::vector<RenderMesh::Corner> corners;
    for (const std::vector<std::size_t>& polygon : soup.polygons) {
        corners.clear();
        for (std::size_t p : polygon) corners.push_back({std::uint32_t(p), of(soup.uvs, p), normalOf(p)});
        mesh.addFace(corners, RenderMesh::kNone, RenderMesh::kNone);
    }
    return mesh;
}

PolygonSoup soupOf(const RenderMesh& mesh)
{
    PolygonSoup soup;
    soup.points = mesh.points;
    soup.polygons.reserve(mesh.faces());
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        std::vector<std::size_t>& polygon = soup.polygons.emplace_back();
        polygon.reserve(mesh.face(f).size());
        for (const RenderMesh::Corner& c : mesh.face(f)) polygon.push_back(c.point);
    }
    return soup;
}

DrawnTopology drawnTopology(const Surface& surface)
{
    DrawnTopology drawn;
    drawn.mesh.points = surface.points;
    for (const auto& t : surface.triangles) {
        const std::array<RenderMesh::Corner, 3> corners{{{t[0]}, {t[1]}, {t[2]}}};
        drawn.mesh.addFace(corners, RenderMesh::kNone, RenderMesh::kNone);
    }
    drawn.fragment = surface.fragment;
    drawn.torn = surface.torn;
    return drawn;
}

void setNormals(RenderMesh& mesh, double crease, std::span<const std::uint32_t> part)
{
    const double least = std::cos(crease * std::numbers::pi / 180);
    std::vector<Vec3> area(mesh.faces());
    std::vector<std::uint32_t> start(mesh.points.size() + 1, 0), round(mesh.corners.size());
    for (const auto& c : mesh.corners) ++start[c.point + 1];
    for (std::size_t p = 0; p < mesh.points.size(); ++p) start[p + 1] += start[p];
    std::vector<std::uint32_t> at(start.begin(), start.end() - 1);
    for (std::uint32_t f = 0; f < mesh.faces(); ++f) {
        const auto face = mesh.face(f);
        area[f] = doubleArea(face.size(), [&](std::size_t k) { return mesh.points[face[k].point]; });
        for (const auto& c : face) round[at[c.point]++] = f;
    }
    mesh.normals.clear();
    for (std::uint32_t f = 0; f < mesh.faces(); ++f) {
        const std::uint32_t begin = f == 0 ? 0 : mesh.faceEnd[f - 1];
        for (std::uint32_t k = begin; k < mesh.faceEnd[f]; ++k) {
            RenderMesh::Corner& corner = mesh.corners[k];
            Vec3 sum = Vec3::Zero();
            for (std::uint32_t i = start[corner.point]; i < start[corner.point + 1]; ++i)
                if ((part.empty() || part[round[i]] == part[f]) &&
                    area[round[i]].dot(area[f]) >= least * area[round[i]].norm() * area[f].norm())
                    sum += area[round[i]];
            corner.normal = std::uint32_t(mesh.normals.size());
            mesh.normals.push_back(sum.isZero() ? Vec3(Vec3::UnitY()) : Vec3(sum.stableNormalized()));
        }
    }
}

std::string_view materialOf(const DrawnTopology& drawn, std::size_t face)
{
    if (drawn.torn[face] != 0) return drawn.mesh.torn;
    const std::uint32_t own = drawn.mesh.material[face];
    return own == RenderMesh::kNone ? std::string_view("outside") : drawn.mesh.materials[own];
}

namespace {

/// The numbers that `each` calls something with, twice; rising, without RenderMesh::kNone.
template <class Each>
std::vector<std::uint32_t> risingNumbers(const Each& each)
{
    std::uint32_t first = RenderMesh::kNone, end = 0;
    each([&](std::uint32_t i) {
        if (i != RenderMesh::kNone) first = std::min(first, i), end = std::max(end, i + 1);
    });
    if (first >= end) return {};
    std::vector<std::uint8_t> isUsed(end - first, 0);
    each([&](std::uint32_t i) {
        if (i != RenderMesh::kNone) isUsed[i - first] = 1;
    });
    std::vector<std::uint32_t> used;
    for (std::uint32_t i = first; i < end; ++i)
        if (isUsed[i - first]) used.push_back(i);
    return used;
}

}  // namespace

std::vector<std::uint32_t> usedPoints(const RenderMesh& mesh)
{
    return risingNumbers([&](const auto& use) {
        for (const RenderMesh::Corner& c : mesh.corners) use(c.point);
    });
}

std::vector<std::uint32_t> usedNormals(const RenderMesh& mesh)
{
    const auto hasNone = [](const RenderMesh::Corner& c) { return c.normal == RenderMesh::kNone; };
    if (std::ranges::any_of(mesh.corners, hasNone)) return {};
    return risingNumbers([&](const auto& use) {
        for (const RenderMesh::Corner& c : mesh.corners) use(c.normal);
    });
}

std::vector<std::uint32_t> usedBy(const RenderMesh& mesh, std::span<const std::uint32_t> faces,
                                  std::uint32_t RenderMesh::Corner::*number)
{
    return risingNumbers([&](const auto& use) {
        for (const std::uint32_t f : faces)
            for (const RenderMesh::Corner& c : mesh.face(f)) use(c.*number);
    });
}

Surface triangleSurface(const DrawnTopology& topology, std::span<const Vec3> points)
{
    Surface surface;
    surface.points.assign(points.begin(), points.end());
    const Fans fans = fansOf(topology.mesh);
    for (std::size_t i = 0; i < fans.face.size(); ++i) {
        const auto& c = fans.corners[i];
        const auto& corner = topology.mesh.corners;
        surface.triangles.push_back({corner[c[0]].point, corner[c[1]].point, corner[c[2]].point});
        surface.fragment.push_back(topology.fragment[fans.face[i]]);
        surface.torn.push_back(topology.torn[fans.face[i]]);
    }
    return surface;
}

}  // namespace vdbfrac::tetmesh
