#include <vdbfrac/base/primitive.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

/// Distance to a box given how far each coordinate lies beyond its face.
double beyondFaces(const Eigen::Ref<const Eigen::VectorXd>& q)
{
    return q.cwiseMax(0.).norm() + std::min(0., q.maxCoeff());
}

}  // namespace

double signedDistance(const Primitive& s, const Vec3& X)
{
    switch (s.kind) {
    case Primitive::Kind::box: return beyondFaces((X - s.center).cwiseAbs() - 0.5 * s.size);
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

Bounds bounds(const Primitive& s)
{
    // How far a disk of radius r around the axis reaches along each coordinate.
    const Vec3 disk = (Vec3::Ones() - s.axis.cwiseAbs2()).cwiseMax(0.).cwiseSqrt();
    Vec3 reach = Vec3::Constant(kInfinity);
    switch (s.kind) {
    case Primitive::Kind::box: reach = 0.5 * s.size; break;
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
