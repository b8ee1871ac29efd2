#include <vdbfrac/base/triangle.h>

#include <algorithm>

namespace vdbfrac {

ClosestPoint closestPoint(const std::array<Vec3, 3>& corners, const Vec3& X)
{
    using On = ClosestPoint::On;
    const auto& [a, b, c] = corners;
    const Vec3 ab = b - a, ac = c - a, ap = X - a, bp = X - b, cp = X - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return {a, On::corner, 0};
    if (d3 >= 0 && d4 <= d3) return {b, On::corner, 1};
    const double vc = d1 * d4 - d3 * d2;
    // d1 = d3 where a and b are one point: then the other edges tell.
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {a + d1 / (d1 - d3) * ab, On::edge, 0};
    if (d6 >= 0 && d5 <= d6) return {c, On::corner, 2};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + d2 / (d2 - d6) * ac, On::edge, 2};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), On::edge, 1};
    return {a + (vb * ab + vc * ac) / (va + vb + vc), On::face, 0};
}

Vec3 sharesOf(const std::array<Vec3, 3>& corner, const Vec3& X)
{
    const Vec3 u = corner[1] - corner[0], v = corner[2] - corner[0], w = X - corner[0];
    const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), det = uu * vv - uv * uv;
    constexpr double kFlat = 1e-12;  // squared sine of an angle: below it rounding tells nothing
    if (!(det > kFlat * uu * vv)) {
        const double t = std::max(uu, vv) > 0 ? std::clamp(uu > vv ? w.dot(u) / uu : w.dot(v) / vv, 0., 1.) : 0;
        return uu > vv ? Vec3(1 - t, t, 0) : Vec3(1 - t, 0, t);
    }
    const double b = (vv * u.dot(w) - uv * v.dot(w)) / det, c = (uu * v.dot(w) - uv * u.dot(w)) / det;
    return {1 - b - c, b, c};
}

}  // namespace vdbfrac
