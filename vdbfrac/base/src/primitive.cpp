#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/primitive.h>

#include <vdbfrac/base/rotation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace vdbfrac {

namespace {

struct AxisPoint {
    double along;   // signed distance along the axis from the center
    double radial;  // distance from the axis
};

AxisPoint toAxis(const Primitive& s, const Vec3& X)
{
    const Vec3 d = X - s.center;
    const double along = d.dot(s.axis);
    return {along, (d - along * s.axis).norm()};
}

/// From the center of a box, along its edges.
Vec3 alongEdges(const Primitive& s, const Vec3& X)
{
    const Vec3 d = X - s.center;
    return s.rotate.isZero(0) ? d : rotationOf(s.rotate).transpose() * d;
}

/// Distance to a box given how far each coordinate lies beyond its face.
double beyondFaces(const Eigen::Ref<const Eigen::VectorXd>& q)
{
    return q.cwiseMax(0.).norm() + std::min(0., q.maxCoeff());
}

}  // namespace

double signedDistance(const Primitive& s, const Vec3& X)
{
    switch (s.kind) {
    case Primitive::Kind::box: return beyondFaces(alongEdges(s, X).cwiseAbs() - 0.5 * s.size);
    case Primitive::Kind::sphere: return (X - s.center).norm() - s.radius;
    case Primitive::Kind::cylinder: {
        const AxisPoint p = toAxis(s, X);
        if (s.height == 0) return p.radial - s.radius;
        return beyondFaces(Eigen::Vector2d(p.radial - s.radius, std::abs(p.along) - 0.5 * s.height));
    }
    case Primitive::Kind::capsule: {
        const AxisPoint p = toAxis(s, X);
        return std::hypot(p.radial, std::max(0., std::abs(p.along) - 0.5 * s.height)) - s.radius;
    }
    case Primitive::Kind::torus: {
        const AxisPoint p = toAxis(s, X);
        return std::hypot(p.radial - s.radius, p.along) - s.tube;
    }
    case Primitive::Kind::halfspace: return s.offset - s.axis.dot(X);
    }
    return kInfinity;
}

namespace {

/// What grows the distance beyondFaces() tells fastest.
template <class V>
V awayFromFaces(const V& q)
{
    const V beyond = q.cwiseMax(0.);
    if (beyond.norm() > 0) return beyond.normalized();
    typename V::Index nearest;
    q.maxCoeff(&nearest);
    return V::Unit(nearest);
}

/// A direction of the plane of an axis and a point, in world space: `d` as (radial, along).
Vec3 fromAxisPlane(const Primitive& s, const Vec3& X, const Eigen::Vector2d& d)
{
    const Vec3 offset = X - s.center, across = offset - offset.dot(s.axis) * s.axis;
    const Vec3 radial = across.norm() > 0 ? across.normalized() : s.axis.unitOrthogonal();
    return d.x() * radial + d.y() * s.axis;
}

}  // namespace

Vec3 distanceGradient(const Primitive& s, const Vec3& X)
{
    const AxisPoint p = toAxis(s, X);
    const double side = p.along < 0 ? -1 : 1, excess = std::abs(p.along) - 0.5 * s.height;
    const auto unit = [](double radial, double along) {
        const Eigen::Vector2d v(radial, along);
        return v.norm() > 0 ? v.normalized().eval() : Eigen::Vector2d(1, 0);
    };
    switch (s.kind) {
    case Primitive::Kind::box: {
        const Vec3 d = alongEdges(s, X), away = awayFromFaces<Vec3>(d.cwiseAbs() - 0.5 * s.size);
        const Vec3 out = away.binaryExpr(d, [](double a, double c) { return c < 0 ? -a : a; });
        return s.rotate.isZero(0) ? out : rotationOf(s.rotate) * out;
    }
    case Primitive::Kind::sphere: {
        const Vec3 d = X - s.center;
        return d.norm() > 0 ? d.normalized().eval() : Vec3::UnitY().eval();
    }
    case Primitive::Kind::cylinder: {
        if (s.height == 0) return fromAxisPlane(s, X, {1, 0});
        const Eigen::Vector2d away = awayFromFaces<Eigen::Vector2d>({p.radial - s.radius, excess});
        return fromAxisPlane(s, X, {away.x(), side * away.y()});
    }
    case Primitive::Kind::capsule: return fromAxisPlane(s, X, unit(p.radial, side * std::max(0., excess)));
    case Primitive::Kind::torus: return fromAxisPlane(s, X, unit(p.radial - s.radius, p.along));
    case Primitive::Kind::halfspace: break;
    }
    return -s.axis;
}

double halfThickness(const Primitive& s)
{
    switch (s.kind) {
    case Primitive::Kind::box: return 0.5 * s.size.minCoeff();
    case Primitive::Kind::cylinder: return s.height > 0 ? std::min(s.radius, 0.5 * s.height) : s.radius;
    case Primitive::Kind::sphere:
    case Primitive::Kind::capsule: return s.radius;
    case Primitive::Kind::torus: return s.tube;
    case Primitive::Kind::halfspace: break;
    }
    return kInfinity;
}

Bounds bounds(const Primitive& s)
{
    // How far a disk of radius r around the axis reaches along each coordinate.
    const Vec3 disk = (Vec3::Ones() - s.axis.cwiseAbs2()).cwiseMax(0.).cwiseSqrt();
    Vec3 reach = Vec3::Constant(kInfinity);
    switch (s.kind) {
    case Primitive::Kind::box: reach = 0.5 * (rotationOf(s.rotate).cwiseAbs() * s.size); break;
    case Primitive::Kind::sphere: reach = Vec3::Constant(s.radius); break;
    case Primitive::Kind::cylinder:
        if (s.height > 0) reach = s.radius * disk + 0.5 * s.height * s.axis.cwiseAbs();
        break;
    case Primitive::Kind::capsule: reach = Vec3::Constant(s.radius) + 0.5 * s.height * s.axis.cwiseAbs(); break;
    case Primitive::Kind::torus: reach = s.radius * disk + Vec3::Constant(s.tube); break;
    case Primitive::Kind::halfspace: break;
    }
    return {s.center - reach, s.center + reach};
}

}  // namespace vdbfrac
