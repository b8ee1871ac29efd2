// Limits, orders, medians, periods: the arithmetic behind 'vdbfrac study', on data whose answers are known.
#include <vdbfrac/lab/study/oscillation.h>
#include <vdbfrac/lab/study/references.h>

#include <gtest/gtest.h>

#include <cmath>

namespace vdbfrac::lab::study {
namespace {

constexpr double kRounding = 1e-9;  // of pow, log and sixty halvings of an interval

/// f + c h^p at h = 1, r, r^2, ...
std::vector<Level> sequence(double limit, double c, double p, std::vector<double> hs)
{
    std::vector<Level> levels;
    for (const double h : hs) levels.push_back({h, limit + c * std::pow(h, p)});
    return levels;
}

TEST(Richardson, FindsLimitAndOrderOfAPowerLaw)
{
    for (const double p : {.5, 1., 2., 3.7})
        for (const std::vector<double>& hs :
             {std::vector{1., .5, .25}, std::vector{1., .6, .5}, std::vector{2., 1., .5, .25, .125}}) {
            const auto e = richardson(sequence(3, -.4, p, hs));
            ASSERT_TRUE(e) << p;
            EXPECT_NEAR(e->value, 3, 10 * kRounding) << p;
            EXPECT_NEAR(e->order, p, 10 * kRounding);
        }
}

TEST(Richardson, UncertaintyIsTheWayFromTheFinestOrHowFarTheLimitMoved)
{
    const auto three = richardson(sequence(3, 1, 1, {1, .5, .25}));
    EXPECT_NEAR(three->uncertainty, .25, kRounding);
    const auto four = richardson(sequence(3, 1, 1, {1, .5, .25, .125}));
    EXPECT_NEAR(four->uncertainty, .05 * .125, kRounding);  // of an exact power law the limit does not move
    std::vector<Level> mixed = sequence(3, 1, 1, {1, .5, .25, .125});
    for (Level& l : mixed) l.value += l.h * l.h * l.h;
    const auto moved = richardson(mixed);
    EXPECT_GT(moved->uncertainty, std::abs(moved->value - 3));  // it covers the error
    // Another order than is expected: the limit is no surer than the difference between both.
    const auto steep = sequence(3, 1, 3, {1, .5, .25, .125});
    EXPECT_NEAR(richardson(steep, 3)->uncertainty, richardson(steep)->uncertainty, kRounding);
    const double fine = steep[3].value, toFirst = 2 * fine - steep[2].value;
    EXPECT_NEAR(richardson(steep, 1)->uncertainty, std::abs(toFirst - 3), kRounding);
}

TEST(Richardson, RefusesWhatDoesNotConverge)
{
    EXPECT_FALSE(richardson(sequence(3, 1, 1, {1, .5})));
    const std::vector<Level> zigzag = {{1, 1}, {.5, 2}, {.25, 1.5}}, growing = {{1, 1}, {.5, 2}, {.25, 4}},
                             still = {{1, 1}, {.5, 1}, {.25, 1}};
    EXPECT_FALSE(richardson(zigzag));
    EXPECT_FALSE(richardson(growing));
    EXPECT_FALSE(richardson(still));
}

TEST(Orders, AreTheSlopesOfErrors)
{
    EXPECT_NEAR(*orderOf(sequence(0, 5, 2, {1, .5, .1})), 2, kRounding);
    EXPECT_FALSE(orderOf(sequence(0, 5, 2, {1})));
}

TEST(Pareto, KeepsWhatNothingElseBeats)
{
    const std::vector<double> cost = {1, 2, 3, 4, 2, 5}, error = {9, 5, 6, 1, 4, 1};
    EXPECT_EQ(paretoFront(cost, error), (std::vector<std::size_t>{0, 4, 3}));
    EXPECT_TRUE(paretoFront({}, {}).empty());
}

TEST(Median, OfFiveLiesBetweenTheEndsWithFifteenSixteenths)
{
    const Interval i = medianOf({5, 1, 4, 2, 3});
    EXPECT_EQ(i.median, 3);
    EXPECT_EQ(i.low, 1);
    EXPECT_EQ(i.high, 5);
    EXPECT_DOUBLE_EQ(i.confidence, 15. / 16);
}

TEST(Median, OfManyLiesBetweenInnerValues)
{
    const Interval i = medianOf({1, 2, 3, 4, 5, 6, 7, 8, 9});
    EXPECT_EQ(i.low, 2);
    EXPECT_EQ(i.high, 8);
    EXPECT_NEAR(i.confidence, 1 - 20. / 512, kRounding);
    EXPECT_EQ(medianOf({7}).median, 7);
    EXPECT_EQ(medianOf({7}).confidence, 0);
    EXPECT_EQ(medianOf({1, 2}).median, 1.5);
}

TEST(MassDistance, IsTheShareThatLiesInFragmentsOfOtherSizes)
{
    const std::vector<double> a = {3, 1}, same = {1.5, .5}, one = {4}, turned = {1, 3};
    EXPECT_NEAR(massDistance(a, same), 0, kRounding);
    EXPECT_NEAR(massDistance(a, turned), 0, kRounding);
    EXPECT_NEAR(massDistance(a, one), .25, kRounding);
    EXPECT_NEAR(massDistance(one, a), .25, kRounding);
    EXPECT_EQ(massDistance({}, a), 1);
    EXPECT_EQ(massDistance({}, {}), 0);
}

/// u = level + a exp(-rate t) cos(2 pi t / period)
struct Swing {
    std::vector<double> t, u;
    Swing(double period, double rate, double level, double dt, double length)
    {
        for (double s = 0; s <= length; s += dt) {
            t.push_back(s);
            u.push_back(level + .3 * std::exp(-rate * s) * std::cos(2 * M_PI * s / period));
        }
    }
    Samples samples() const { return {t, u}; }
};

TEST(Oscillation, PeriodAndDampingOfADampedCosine)
{
    constexpr double kOfSamples = 2e-3;  // forty a swing, in between a line or a parabola
    const Swing swing(.8, .2, .05, .02, 5);
    EXPECT_NEAR(*periodOf(swing.samples(), .05), .8, kOfSamples * .8);
    EXPECT_NEAR(*dampingOf(swing.samples(), .05), .2, 10 * kOfSamples * .2);
}

TEST(Oscillation, RipplesAreNoSwings)
{
    constexpr double kRipple = .03, kOfRipple = .05;  // the ripple shifts peaks by itself
    Swing swing(.8, .2, .05, .005, 5);
    for (std::size_t i = 0; i < swing.t.size(); ++i)
        swing.u[i] += kRipple * std::exp(-.2 * swing.t[i]) * std::cos(14 * M_PI * swing.t[i] / .8);
    EXPECT_NEAR(*dampingOf(swing.samples(), .05), .2, kOfRipple * .2);
}

TEST(Oscillation, FindsItsRestByItself)
{
    constexpr double kOfMean = 0.02;  // a decaying swing is not about its mean
    const Swing swing(.8, .05, .05, .02, 5.3);
    EXPECT_NEAR(*periodOf(swing.samples(), {}), .8, kOfMean * .8);
}

TEST(Oscillation, WithoutSwingsThereIsNone)
{
    const std::vector<double> t = {0, 1, 2, 3}, up = {0, 1, 2, 3};
    EXPECT_FALSE(periodOf({t, up}, {}));
    EXPECT_FALSE(dampingOf({t, up}, {}));
    EXPECT_FALSE(periodOf({}, {}));
}

}  // namespace
}  // namespace vdbfrac::lab::study
