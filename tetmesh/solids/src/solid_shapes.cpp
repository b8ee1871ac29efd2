#include "solid_shapes.h"

#include <vdbfrac/base/rotation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

namespace vdbfrac::solids {

namespace {

constexpr double kPi = std::numbers::pi;

int pieces(double length, double edge) { return std::max(1, int(std::lround(std::ceil(length / edge - 1e-9)))); }

/// Edge on a curve of a radius: the chord is off by edge^2 / 8 r.
double edgeOn(double radius, double edge)
{
    constexpr double kOff = 1. / 50;  // of edge
    return std::min(edge, std::sqrt(8 * radius * kOff * edge));
}

/// Axes of a solid: the last along `axis`, right-handed.
Mat3 frameOf(const Vec3& axis)
{
    Mat3 frame;
    frame.col(2) = axis.normalized();
    frame.col(0) = frame.col(2).unitOrthogonal();
    frame.col(1) = frame.col(2).cross(frame.col(0));
    return frame;
}

/// The same turned about the axis by an angle that nothing else has: else points of round solids fall onto those of
/// boxes but for their last digits, and their intersection has slivers as thin.
Mat3 turnedFrameOf(const Vec3& axis)
{
    constexpr double kTurn = 0.2374;  // rad
    return frameOf(axis) * Eigen::AngleAxisd(kTurn, Vec3::UnitZ()).toRotationMatrix();
}

/// Squares between points that have names: each name is one point.
template <class Name>
class Builder {
public:
    explicit Builder(std::function<Vec3(const Name&)> place) : place_(std::move(place)) {}
    /// Corners counter-clockwise seen from outside.
    void square(const Name& a, const Name& b, const Name& c, const Name& d)
    {
        const std::uint32_t p = point(a), q = point(b), r = point(c), s = point(d);
        add(p, q, r), add(p, r, s);
    }
    Triangles result;

private:
    std::uint32_t point(const Name& name)
    {
        const auto [it, isNew] = number_.emplace(name, std::uint32_t(result.points.size()));
        if (isNew) result.points.push_back(place_(name));
        return it->second;
    }
    void add(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        if (a != b && b != c && c != a) result.triangles.push_back({a, b, c});
    }
    std::function<Vec3(const Name&)> place_;
    std::map<Name, std::uint32_t> number_;
};

/// The surface of n[0] x n[1] x n[2] cells, whose corners (i, j, k) are where `place` says.
Triangles surfaceOfCells(const std::array<int, 3>& n, std::function<Vec3(const std::array<int, 3>&)> place)
{
    Builder<std::array<int, 3>> builder(std::move(place));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (const int side : {0, n[axis]})
            for (int j = 0; j < n[v]; ++j)
                for (int i = 0; i < n[u]; ++i) {
                    const auto at = [&](int di, int dj) {
                        std::array<int, 3> name{};
                        name[axis] = side, name[u] = i + di, name[v] = j + dj;
                        return name;
                    };
                    if (side > 0)
                        builder.square(at(0, 0), at(1, 0), at(1, 1), at(0, 1));
                    else
                        builder.square(at(0, 0), at(0, 1), at(1, 1), at(1, 0));
                }
    }
    return std::move(builder.result);
}

/// A box with its axes along those of `frame`, divided into n[k] pieces along axis k.
Triangles box(const Vec3& center, const Mat3& frame, const Vec3& size, const std::array<int, 3>& n)
{
    return surfaceOfCells(n, [&](const std::array<int, 3>& at) -> Vec3 {
        Vec3 local;
        for (std::size_t k = 0; k < 3; ++k) local[int(k)] = size[int(k)] * (double(at[k]) / n[k] - 0.5);
        return center + frame * local;
    });
}

/// Two half balls with a tube of a length between them; a cube blown up to a ball, its upper half lifted.
Triangles capsule(const Primitive& solid, double length, double edge)
{
    const double r = solid.radius;
    const int half = std::max(1, pieces(kPi / 4 * r, edgeOn(r, edge))), n = 2 * half;
    const int stacks = length > 0 ? pieces(length, edge) : 0;
    const Mat3 frame = turnedFrameOf(solid.axis);
    return surfaceOfCells({n, n, n + stacks}, [&](const std::array<int, 3>& at) -> Vec3 {
        const int along = std::clamp(at[2] - half, 0, stacks);  // layers of the tube below
        Vec3 onCube;
        for (std::size_t k = 0; k < 3; ++k)  // even on the ball, nearly
            onCube[int(k)] = std::tan(kPi / 4 * (double(at[k] - (k == 2 ? along : 0)) / half - 1));
        const double lift = stacks > 0 ? length * (double(along) / stacks - 0.5) : 0;
        return solid.center + frame * (r * onCube.normalized() + lift * Vec3::UnitZ());
    });
}

/// A point of the unit disk for one of the square [-1, 1]^2, with little distortion. Source: Shirley, Chiu 1997.
std::array<double, 2> onDisk(double u, double v)
{
    if (u == 0 && v == 0) return {0, 0};
    const bool wide = std::abs(u) > std::abs(v);
    const double r = wide ? u : v, angle = wide ? kPi / 4 * v / u : kPi / 2 - kPi / 4 * u / v;
    return {r * std::cos(angle), r * std::sin(angle)};
}

/// A tube along an axis between two disks.
Triangles cylinder(const Primitive& solid, double length, double edge)
{
    using Name = std::array<int, 3>;  // i, j on the square of a disk or its rim; k along the tube
    const double r = solid.radius;
    const int n = std::max(2, pieces(kPi / 2 * r, edgeOn(r, edge))), stacks = pieces(length, edge);
    const Mat3 frame = turnedFrameOf(solid.axis);
    Builder<Name> builder([&](const Name& name) -> Vec3 {
        const auto [i, j, k] = name;
        const auto d = onDisk(2. * i / n - 1, 2. * j / n - 1);
        return solid.center + frame * Vec3(r * d[0], r * d[1], length * (double(k) / stacks - 0.5));
    });
    for (const bool top : {false, true})
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const int k = top ? stacks : 0;
                const Name a{i, j, k}, b{i + 1, j, k}, c{i + 1, j + 1, k}, d{i, j + 1, k};
                // The diagonal of a corner goes to the corner: no triangle has all its points on the rim.
                if ((i == 0) == (j == 0) || (i > 0 && i < n - 1) || (j > 0 && j < n - 1))
                    top ? builder.square(a, b, c, d) : builder.square(a, d, c, b);
                else
                    top ? builder.square(b, c, d, a) : builder.square(b, a, d, c);
            }
    std::vector<std::array<int, 2>> rim;  // counter-clockwise
    for (int i = 0; i < n; ++i) rim.push_back({i, 0});
    for (int j = 0; j < n; ++j) rim.push_back({n, j});
    for (int i = n; i > 0; --i) rim.push_back({i, n});
    for (int j = n; j > 0; --j) rim.push_back({0, j});
    for (int k = 0; k < stacks; ++k)
        for (std::size_t s = 0; s < rim.size(); ++s) {
            const auto &p = rim[s], &q = rim[(s + 1) % rim.size()];
            builder.square({p[0], p[1], k}, {q[0], q[1], k}, {q[0], q[1], k + 1}, {p[0], p[1], k + 1});
        }
    return std::move(builder.result);
}

Triangles torus(const Primitive& solid, double edge)
{
    using Name = std::array<int, 2>;
    const double outer = solid.radius + solid.tube;
    const int n = std::max(8, pieces(2 * kPi * outer, edgeOn(outer, edge)));
    const int m = std::max(8, pieces(2 * kPi * solid.tube, edgeOn(solid.tube, edge)));
    const Mat3 frame = turnedFrameOf(solid.axis);
    Builder<Name> builder([&](const Name& name) -> Vec3 {
        const double a = 2 * kPi * name[0] / n, b = 2 * kPi * name[1] / m;
        const double rho = solid.radius + solid.tube * std::cos(b);
        return solid.center + frame * Vec3(rho * std::cos(a), rho * std::sin(a), solid.tube * std::sin(b));
    });
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const int k = (i + 1) % n, l = (j + 1) % m;
            builder.square({i, j}, {k, j}, {k, l}, {i, l});
        }
    return std::move(builder.result);
}

/// A box whose bottom is the plane, and that holds all of `within` beyond it.
Triangles halfspace(const Primitive& solid, double edge, const Bounds& within)
{
    const Vec3 axis = solid.axis.normalized(), middle = 0.5 * (within.lower + within.upper);
    const double reach = (within.upper - within.lower).norm() + 4 * edge;
    const double toPlane = solid.offset - axis.dot(middle), height = reach + std::abs(toPlane);
    const int n = pieces(reach, edge);
    return box(middle + (toPlane + height / 2) * axis, frameOf(axis), Vec3(reach, reach, height), {n, n, 1});
}

}  // namespace

Triangles trianglesOf(const Primitive& solid, double edge, const Bounds& within)
{
    using enum Primitive::Kind;
    switch (solid.kind) {
    case box: {
        std::array<int, 3> n{};
        for (std::size_t k = 0; k < 3; ++k) n[k] = pieces(solid.size[int(k)], edge);
        return solids::box(solid.center, rotationOf(solid.rotate), solid.size, n);
    }
    case sphere: return solids::capsule(solid, 0, edge);
    case capsule: return solids::capsule(solid, solid.height, edge);
    case cylinder: {
        if (solid.height > 0) return solids::cylinder(solid, solid.height, edge);
        Primitive bounded = solid;
        const Vec3 axis = solid.axis.normalized(), middle = 0.5 * (within.lower + within.upper);
        bounded.center += axis * axis.dot(middle - solid.center);
        return solids::cylinder(bounded, (within.upper - within.lower).norm() + 4 * edge, edge);
    }
    case torus: return solids::torus(solid, edge);
    case halfspace: break;
    }
    return solids::halfspace(solid, edge, within);
}

}  // namespace vdbfrac::solids
