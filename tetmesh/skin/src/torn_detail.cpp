#include "torn_detail.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/noise.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::skin {

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
                    moved[k] += std::ldexp(tetmesh::noise(std::ldexp(1 / detail.size, octave) * p.X,
                                                          detail.seed + std::uint64_t(3 * octave + k)),
                                           -octave);
            p.X += fade * detail.amplitude * moved;
        }
    });
}

}  // namespace vdbfrac::skin
