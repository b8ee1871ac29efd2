// Slides points over the outer surface. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/base/triangle.h>
#include <vdbfrac/skin/skin_cut.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace vdbfrac::skin {

class Slider {
public:
    explicit Slider(const SkinTopology& skin) : skin_(skin) {}

    /// The closest point to X of the smooth face that `point` was on, or of the sharp edge where it was on one. `at`:
    /// the triangle to look from, and then the one that it lies on.
    Vec3 closest(const SkinCut::Point& point, const Vec3& X, std::uint32_t& at) const
    {
        const bool sharp = point.onEdge && skin_.isSharp[point.skin];
        const Vec3 normal = normalAt(point);
        double nearest = std::numeric_limits<double>::infinity();
        Vec3 best = X;
        // From triangle to triangle, as long as they are as near as what was found.
        std::vector<std::uint32_t> reached{at};
        for (std::size_t i = 0; i < reached.size(); ++i) {
            const std::uint32_t t = reached[i];
            if (!sharp && !isOneFace(skin_.normal[t], normal)) continue;
            const Vec3 there = closestPoint(skin_.corners(t), X).at;
            const auto keep = [&](const Vec3& p) {
                if (const double d = (p - X).squaredNorm(); d < nearest) nearest = d, best = p, at = t;
            };
            if (sharp)
                visitSharpEdges(t, skin_.along(point.skin), X, keep);
            else
                keep(there);
            if ((there - X).squaredNorm() > nearest) continue;
            for (const std::uint32_t e : skin_.edgeOf[t])
                for (const std::uint32_t beside : skin_.trianglesOf[e])
                    if (std::find(reached.begin(), reached.end(), beside) == reached.end()) reached.push_back(beside);
        }
        return best;
    }

    /// Of the outer surface; 0 where the point is in a torn face.
    Vec3 normalAt(const SkinCut::Point& point) const
    {
        if (point.skin == SkinCut::kNoSkin) return Vec3::Zero();
        return point.onEdge ? skin_.edgeNormal[point.skin] : skin_.normal[point.skin];
    }

private:
    /// Faces without area have no normal, and are of any face.
    static bool isOneFace(const Vec3& a, const Vec3& b) { return a.isZero() || b.isZero() || a.dot(b) >= kSameFace; }

    /// Those that run `along` a direction: round a corner it is another edge.
    template <class Keep>
    void visitSharpEdges(std::uint32_t t, const Vec3& along, const Vec3& X, const Keep& keep) const
    {
        const std::array<Vec3, 3> c = skin_.corners(t);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t e = skin_.edgeOf[t][k];
            if (skin_.isSharp[e] && std::abs(skin_.along(e).dot(along)) >= kSameFace)
                keep(closestPoint({c[k], c[(k + 1) % 3], c[(k + 1) % 3]}, X).at);
        }
    }

    const SkinTopology& skin_;
};

}  // namespace vdbfrac::skin
