// Curves of pages: what is left out of long ones.
#include <vdbfrac/report/plots.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace vdbfrac;

namespace {

/// A long curve is thinned; where a column has no value in some steps, as before an effect joins, its peak stays.
TEST(Plots, KeepThePeakOfAColumnWithGaps)
{
    constexpr std::size_t kSteps = 1200, kPeak = 777, kEvery = 4;
    report::Record record;
    std::vector<double>&time = record.columns["time_s"], &fragments = record.columns["fragments"];
    for (std::size_t i = 0; i < kSteps; ++i) {
        time.push_back(double(i));
        fragments.push_back(i % kEvery == 0 ? std::numeric_limits<double>::quiet_NaN() : i == kPeak ? 9 : 1);
    }
    const report::Json plots = report::comparedPlots({record}, {"run"});
    double most = 0;
    std::size_t points = 0, empty = 0;
    for (const report::Json& plot : plots)
        for (const report::Json& curve : plot["series"])
            for (const report::Json& y : curve["y"]) {
                ++points;
                if (y.is_null())
                    ++empty;
                else
                    most = std::max(most, y.get<double>());
            }
    EXPECT_EQ(most, 9);
    EXPECT_GT(points, 100u);
    EXPECT_LT(points, kSteps);
    EXPECT_LE(empty, 1u);
}

}  // namespace
