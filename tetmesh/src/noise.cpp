#include <vdbfrac/tetmesh/noise.h>

#include <vdbfrac/tetmesh/trilinear.h>

namespace vdbfrac::tetmesh {

namespace {

/// A number in [-1, 1) for a point of a grid. `start`: bits of a seed, mixed, or one seed would have what another has
/// somewhere else.
double valueAt(Coord c, std::uint64_t start)
{
    const auto part = [](int v) { return std::uint64_t(std::uint32_t(v)); };
    const std::uint64_t bits = mixedBits(mixedBits(mixedBits(start ^ part(c.x)) ^ part(c.y)) ^ part(c.z));
    return double(std::int64_t(bits)) / 9223372036854775808.;
}

}  // namespace

std::uint64_t mixedBits(std::uint64_t z)
{
    z += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double noise(const Vec3& X, std::uint64_t seed)
{
    const Coord base = floorOf(X);
    Vec3 f = X - base.toVec();
    for (int k = 0; k < 3; ++k) f[k] = f[k] * f[k] * f[k] * (f[k] * (6 * f[k] - 15) + 10);
    const std::uint64_t start = mixedBits(seed);
    double sum = 0;
    for (int c = 0; c < kCorners; ++c) sum += trilinearShare(c, f) * valueAt(base + cornerOffset(c), start);
    return sum;
}

}  // namespace vdbfrac::tetmesh
