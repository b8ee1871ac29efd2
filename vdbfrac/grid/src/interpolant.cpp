#include "interpolant.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::grid {

namespace {

struct Weights {
    std::array<double, 4> value, slope;  // for the voxels at -1, 0, 1, 2
};

Weights weights(double t)
{
    return {
        {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
         (t + 1) * t * (t - 1) / 6},
        {-(3 * t * t - 6 * t + 2) / 6, (3 * t * t - 4 * t - 1) / 2, -(3 * t * t - 2 * t - 2) / 2, (3 * t * t - 1) / 6}};
}

double nearestCrossing(const openvdb::FloatGrid::ConstAccessor& values, const openvdb::Coord& voxel)
{
    const double phi = values.getValue(voxel);
    double nearest = std::numeric_limits<double>::infinity();
    for (int n = 0; n < 27; ++n) {
        const openvdb::Coord d(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
        const double other = values.getValue(voxel + d);
        if ((other < 0) != (phi < 0)) nearest = std::min(nearest, d.asVec3d().length() * phi / (phi - other));
    }
    return nearest;
}

}  // namespace

void Interpolant::gather(const openvdb::Coord& lower)
{
    if (lower == lower_) return;
    lower_ = lower;
    for (int n = 0; n < 64; ++n)
        around_[std::size_t(n)] = values_.getValue(lower.offsetBy(n / 16 - 1, n / 4 % 4 - 1, n % 4 - 1));
}

Interpolant::Sample Interpolant::at(const Vec3& point)
{
    const Vec3 floor = point.array().floor();
    gather({int(floor.x()), int(floor.y()), int(floor.z())});
    const std::array<Weights, 3> w{weights(point.x() - floor.x()), weights(point.y() - floor.y()),
                                   weights(point.z() - floor.z())};
    Sample sample{0, Vec3::Zero()};
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) {
            double value = 0, slope = 0;  // along z
            for (std::size_t k = 0; k < 4; ++k) {
                const double v = around_[16 * i + 4 * j + k];
                value += w[2].value[k] * v;
                slope += w[2].slope[k] * v;
            }
            const double wx = w[0].value[i], wy = w[1].value[j];
            sample.value += wx * wy * value;
            sample.gradient += Vec3(w[0].slope[i] * wy * value, wx * w[1].slope[j] * value, wx * wy * slope);
        }
    return sample;
}

double distanceToZero(const openvdb::FloatGrid::ConstAccessor& values, Interpolant& phi, const openvdb::Coord& voxel)
{
    constexpr int kIterations = 20;
    constexpr double kFarthest = 2, kConverged = 1e-6;  // voxels; floats have no more
    constexpr double kBeyond = 1.25;                    // a crossing is linear, so the distance may be a little more
    const double crossing = nearestCrossing(values, voxel);
    const Vec3 start = fromVdb(voxel).toVec();
    Vec3 p = start;
    for (int i = 0; i < kIterations; ++i) {
        const Interpolant::Sample s = phi.at(p);
        const double g2 = s.gradient.squaredNorm();
        if (!(g2 > 0)) return crossing;
        const Vec3 away = start - p;  // its part along the surface has to vanish
        const Vec3 step = away - (away.dot(s.gradient) + s.value) / g2 * s.gradient;
        p += step;
        const double distance = (p - start).norm();
        if (!(distance < kFarthest)) return crossing;
        if (step.squaredNorm() < kConverged * kConverged) return distance < kBeyond * crossing ? distance : crossing;
    }
    return crossing;
}

}  // namespace vdbfrac::grid
