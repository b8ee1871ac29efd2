#include "torn_detail.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::skin {

namespace {

/// A number in [-1, 1) for a point of a grid.
double valueAt(Coord c, std::uint64_t seed)
{
    const auto part = [](int v) { return std::uint64_t(std::uint32_t(v)); };
    const std::uint64_t bits = mixedBits(mixedBits(mixedBits(seed ^ part(c.x)) ^ part(c.y)) ^ part(c.z));
    return double(std::int64_t(bits)) / 9223372036854775808.;
}

/// Smooth noise in [-1, 1] that changes over a length of 1. Source: value noise, Perlin's fade of 2002.
double noise(const Vec3& X, std::uint64_t seed)
{
    const Coord base = tetmesh::floorOf(X);
    Vec3 f = X - base.toVec();
    for (int k = 0; k < 3; ++k) f[k] = f[k] * f[k] * f[k] * (f[k] * (6 * f[k] - 15) + 10);
    double sum = 0;
    for (int c = 0; c < tetmesh::kCorners; ++c)
        sum += tetmesh::trilinearShare(c, f) * valueAt(base + tetmesh::cornerOffset(c), seed);
    return sum;
}

}  // namespace

void addTornDetail(const TornDetail& detail, const tetmesh::NodeField<float>& rest, double dx, SkinCut& cut)
{
    constexpr double kFadeFrom = 0.25, kFadeOver = 2;  // voxels below the outer surface
    constexpr int kOctaves = 3;
    parallelChunks(cut.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            SkinCut::Point& p = cut.points[i];
            if (p.skin != SkinCut::kNoSkin) continue;
            const double depth = -tetmesh::trilinear(rest, p.X / dx) / dx;
            const double fade = std::clamp((depth - kFadeFrom) / kFadeOver, 0., 1.);
            Vec3 moved = Vec3::Zero();
            for (int octave = 0; octave < kOctaves; ++octave)
                for (int k = 0; k < 3; ++k)
                    moved[k] += std::ldexp(noise(std::ldexp(1 / detail.size, octave) * p.X,
                                                 mixedBits(detail.seed + std::uint64_t(3 * octave + k))),
                                           -octave);
            p.X += fade * detail.amplitude * moved;
        }
    });
}

}  // namespace vdbfrac::skin
