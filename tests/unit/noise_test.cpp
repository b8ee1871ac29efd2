// Noise in space.
#include <vdbfrac/tetmesh/noise.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace vdbfrac;

namespace {

/// Mean product of the noise of two seeds, over that of one with itself, at points of many cells; those of the second
/// mirrored in their cells, or moved by some.
double correlation(std::uint64_t a, std::uint64_t b, bool isMirrored, int moved)
{
    double both = 0, one = 0;
    for (int k = 0; k < 400; ++k)
        for (double x : {.1, .3, .5, .7, .9}) {
            const int cell = 2 * (k % 20);
            const Vec3 at(cell + x, k / 20 + .2, .4), other(moved + cell + (isMirrored ? 1 - x : x), at.y(), at.z());
            both += tetmesh::noise(at, a) * tetmesh::noise(other, b);
            one += tetmesh::noise(at, a) * tetmesh::noise(at, a);
        }
    return both / one;
}

TEST(Noise, OfOneSeedSaysNothingOfAnother)
{
    constexpr double kChance = .25;  // five deviations of 400 cells' mean
    EXPECT_NEAR(correlation(3, 3, false, 0), 1, 1e-12);
    for (std::uint64_t seed : {0, 1, 2, 6})
        for (std::uint64_t other : {1, 2, 3, 7})
            if (seed != other) {
                for (bool isMirrored : {false, true})
                    for (int moved : {-2, 0, 2})
                        EXPECT_LT(std::abs(correlation(seed, other, isMirrored, moved)), kChance)
                            << seed << " " << other << " " << isMirrored << " " << moved;
            }
}

/// Smooth: with steps of eps it changes by no more than its steepest slope, also across faces of cells.
TEST(Noise, IsSmoothAndWithinOne)
{
    constexpr double kSteepest = 2 * 1.875;  // of Perlin's fade, between -1 and 1
    double least = 0, most = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3 at(-3 + .002 * i, .7, -.3), next = at + Vec3(.002, 0, 0);
        const double value = tetmesh::noise(at, 5);
        EXPECT_LE(std::abs(tetmesh::noise(next, 5) - value), .002 * kSteepest);
        least = std::min(least, value), most = std::max(most, value);
    }
    EXPECT_GE(least, -1);
    EXPECT_LE(most, 1);
    EXPECT_LT(least, -.2);
    EXPECT_GT(most, .2);
}

}  // namespace
