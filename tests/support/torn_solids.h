// Solids with a surface of triangles, cracks through them, and what is drawn of both.
#pragma once

#include <vdbfrac/skin/crack_field.h>
#include <vdbfrac/skin/skin_cut.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::test {

using Phi = std::function<double(const Vec3&)>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

struct Solid {
    std::string name;
    Phi phi;
    std::vector<Vec3> points;
    Triangles triangles;
    double reach = 0;  // m
};

/// A cube's surface of n x n squares a side, in [-1, 1]^3.
inline void addCube(Solid& solid, int n)
{
    std::map<std::array<int, 3>, std::uint32_t> number;
    const auto point = [&](std::array<int, 3> at) {
        const auto [it, isNew] = number.emplace(at, std::uint32_t(solid.points.size()));
        if (isNew) solid.points.push_back(Vec3(at[0], at[1], at[2]) * (2. / n) - Vec3::Ones());
        return it->second;
    };
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, n})
            for (int v = 0; v < n; ++v)
                for (int u = 0; u < n; ++u) {
                    const auto at = [&](int du, int dv) {
                        std::array<int, 3> p{};
                        p[axis] = side, p[(axis + 1) % 3] = u + du, p[(axis + 2) % 3] = v + dv;
                        return point(p);
                    };
                    const std::uint32_t a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
                    if (side == 0)
                        solid.triangles.insert(solid.triangles.end(), {{a, c, b}, {a, d, c}});
                    else
                        solid.triangles.insert(solid.triangles.end(), {{a, b, c}, {a, c, d}});
                }
}

inline Solid box(double half, int squares)
{
    Solid s{"box of " + std::to_string(squares) + " squares a side", {}, {}, {}, half};
    s.phi = [half](const Vec3& X) {
        const Vec3 q = X.cwiseAbs() - Vec3::Constant(half);
        return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.);
    };
    addCube(s, squares);
    for (Vec3& p : s.points) p *= half;
    return s;
}

/// Two columns of squares that touch along an edge, which belongs to four faces: no 2-manifold.
inline Solid columns(int squares)
{
    Solid s{"columns of " + std::to_string(squares) + " squares a side", {}, {}, {}, 1};
    for (const double at : {-.5, .5}) {
        Solid column;
        addCube(column, squares);
        const std::uint32_t first = std::uint32_t(s.points.size());
        for (const Vec3& p : column.points) s.points.push_back({at + .5 * p.x(), at + .5 * p.y(), p.z()});
        for (const auto& t : column.triangles) s.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    s.phi = [](const Vec3& X) {
        double nearest = 1e300;
        for (const double at : {-.5, .5}) {
            const Vec3 q = (X - Vec3(at, at, 0)).cwiseAbs() - Vec3(.5, .5, 1);
            nearest = std::min(nearest, q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.));
        }
        return nearest;
    };
    return s;
}

inline Solid ball(double radius, int squares)
{
    Solid s{"ball of " + std::to_string(squares) + " squares a side", {}, {}, {}, radius};
    s.phi = [radius](const Vec3& X) { return X.norm() - radius; };
    addCube(s, squares);
    for (Vec3& p : s.points) {
        for (int k = 0; k < 3; ++k) p[k] = std::tan(p[k] * std::numbers::pi / 4);
        p *= radius / p.norm();
    }
    return s;
}

/// Of radius 1 and length 2 along an axis, `sides` rectangles round it.
inline Solid rod(const Vec3& axis, std::uint32_t sides)
{
    Solid s{"rod of " + std::to_string(sides) + " sides", {}, {}, {}, 1.5};
    s.phi = [axis](const Vec3& X) {
        const double along = axis.dot(X), across = (X - along * axis).norm();
        return std::max(across - 1, std::abs(along) - 1);
    };
    const Vec3 u = axis.unitOrthogonal(), v = axis.cross(u);
    s.points = {-axis, axis};
    for (std::uint32_t i = 0; i < sides; ++i) {
        const double angle = 2 * std::numbers::pi * i / sides;
        const Vec3 round = std::cos(angle) * u + std::sin(angle) * v;
        s.points.push_back(round - axis), s.points.push_back(round + axis);
        const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % sides);
        s.triangles.insert(s.triangles.end(), {{0, b, a}, {a, b, b + 1}, {a, b + 1, a + 1}, {1, a + 1, b + 1}});
    }
    return s;
}

inline tetmesh::NodeField<float> fieldOf(const Phi& phi, double reach, double dx)
{
    const int n = int(std::ceil(reach / dx)) + 4;
    const float far = float(3 * dx);
    tetmesh::NodeField<float> field({-n, -n, -n}, {n, n, n}, far, -far);
    for (int z = -n; z <= n; ++z)
        for (int y = -n; y <= n; ++y)
            for (int x = -n; x <= n; ++x) field.set({x, y, z}, std::clamp(float(phi(dx * Vec3(x, y, z))), -far, far));
    return field;
}

/// A crack along a plane, as far as `ends` says; each voxel node moves it by up to `jagged` voxels, which tears a node
/// on each line across it up to .5.
struct Plane {
    Vec3 normal;
    double offset = 0;
    double ends = 1e9;  // along x
    double jagged = 0;
    double half = 1;  // voxels: half its width
    double c(const Vec3& X, double dx) const
    {
        const Vec3 node = (X / dx).array().round();
        const double random = std::sin(12.9898 * node.x() + 78.233 * node.y() + 37.719 * node.z()) * 43758.5453;
        const double moved = offset + jagged * dx * (2 * (random - std::floor(random)) - 1);
        return std::min(half * dx - std::abs(normal.dot(X) - moved), ends - X.x());
    }
};

inline skin::SkinCut cutBy(const Solid& solid, const Plane& plane, double dx, skin::Lips lips = skin::Lips::asSimulated,
                           const skin::TornDetail& detail = {}, skin::Taken taken = skin::Taken::dropped)
{
    const auto rest = fieldOf(solid.phi, solid.reach, dx);
    const auto now = fieldOf(
        [&](const Vec3& X) {
            const double phi = solid.phi(X);
            return phi < 0 ? std::max(phi, plane.c(X, dx)) : phi;
        },
        solid.reach, dx);
    return skin::SkinCutter(solid.points, solid.triangles, rest, dx).cut(rest, now, {lips, detail}, {}, taken);
}

/// All faces of what is left, with the points they use.
struct Drawn {
    std::vector<Vec3> points;
    Triangles outside, torn;
};
inline Drawn drawn(const Solid& solid, const skin::SkinCut& cut)
{
    Drawn d{solid.points, {}, cut.torn};
    for (const skin::SkinCut::Point& p : cut.points) d.points.push_back(p.X);
    for (std::size_t t = 0; t < solid.triangles.size(); ++t)
        if (cut.fate[t] == skin::SkinCut::Fate::kept) d.outside.push_back(solid.triangles[t]);
    for (const skin::SkinCut::Part& p : cut.parts) d.outside.push_back(p.corner);
    return d;
}

inline double volume(const Drawn& d)
{
    double six = 0;
    for (const auto* some : {&d.outside, &d.torn})
        for (const auto& t : *some) six += d.points[t[0]].dot(d.points[t[1]].cross(d.points[t[2]]));
    return six / 6;
}

inline double area(const std::vector<Vec3>& points, const Triangles& triangles)
{
    double sum = 0;
    for (const auto& t : triangles)
        sum += 0.5 * (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).norm();
    return sum;
}

/// The sides of what is drawn, and how many faces have each.
struct Edges {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<int, 2>> sides;  // of each: outside, torn; directed
    explicit Edges(const Drawn& d)
    {
        for (const int torn : {0, 1})
            for (const auto& t : torn ? d.torn : d.outside)
                for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}][std::size_t(torn)];
    }
    int bad() const
    {
        int bad = 0;
        for (const auto& [edge, n] : sides) {
            const auto back = sides.find({edge.second, edge.first});
            bad += n[0] + n[1] != 1 || back == sides.end();
        }
        return bad;
    }
    double rim(const Drawn& d) const
    {
        double length = 0;
        for (const auto& [edge, n] : sides) {
            const auto back = sides.find({edge.second, edge.first});
            if (n[1] == 1 && back != sides.end() && back->second[0] == 1)
                length += (d.points[edge.first] - d.points[edge.second]).norm();
        }
        return length;
    }
};

inline const std::vector<Vec3> kTilts = {Vec3(0, 1, 0), Vec3(.1, 1, .05).normalized(), Vec3(1, 1, 0).normalized(),
                                         Vec3(.3, 1, -.6).normalized()};

}  // namespace vdbfrac::test
