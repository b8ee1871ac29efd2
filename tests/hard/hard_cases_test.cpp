// The hard cases as 'vdbfrac verify --quick' with --hard and with --torture measures them. What does not hold yet is
// listed here with its number: a change to the better or to the worse has to be entered, here and in docs/hard_cases.md
// or docs/torture.md.
#include <vdbfrac/lab/verify/hard_case.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace vdbfrac::lab::verify {
void PrintTo(const HardCase& c, std::ostream* out) { *out << c.id; }
}  // namespace vdbfrac::lab::verify

using namespace vdbfrac::lab;
using verify::HardCase;

namespace {

/// A measurement that misses its limit today.
struct KnownMiss {
    const char* id;
    const char* what;
    double value;      ///< as measured
    double tolerance;  ///< relative: what another processor or compiler may change
};
const std::vector<KnownMiss> kKnownMisses = {
    // 1000: capped. At the strain 1 / nu a bar with free sides has no thickness left, whatever the solver.
    {"stretched", "nu = 0.3: Newton iterations of a step, pulled to 10 times the length", 1000, 0},
    {"stretched", "nu = 0.3: Newton iterations of a step, let go from 10 times the length", 1000, 0},
    {"stretched", "nu = 0.49: Newton iterations of a step, pulled to 10 times the length", 1000, 0},
    {"stretched", "nu = 0.49: Newton iterations of a step, let go from 10 times the length", 1000, 0},
};

const KnownMiss* knownMiss(const HardCase& c, const std::string& what)
{
    const auto miss = std::find_if(kKnownMisses.begin(), kKnownMisses.end(),
                                   [&](const KnownMiss& m) { return std::string(c.id) == m.id && what == m.what; });
    return miss == kKnownMisses.end() ? nullptr : &*miss;
}

class HardCases : public testing::TestWithParam<HardCase> {};

TEST_P(HardCases, AreWithinTheirLimitsButForTheKnownMisses)
{
    if (!GetParam().measure) GTEST_SKIP() << "not there yet";
    const auto measured = GetParam().measure(verify::Extent::quick);
    EXPECT_FALSE(measured.empty());
    for (const verify::Measurement& m : measured) {
        std::printf("%s: %.4g (limit %g)\n", m.what.c_str(), m.value, m.limit);
        if (const KnownMiss* miss = knownMiss(GetParam(), m.what)) {
            EXPECT_FALSE(m.holds()) << m.what << ": holds now; take it off the list";
            EXPECT_NEAR(m.value, miss->value, miss->tolerance * miss->value) << m.what;
        } else {
            EXPECT_TRUE(m.holds()) << m.what << " is " << m.value;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Table, HardCases, testing::ValuesIn(verify::hardCases().begin(), verify::hardCases().end()),
                         [](const auto& info) { return std::string(info.param.id); });

INSTANTIATE_TEST_SUITE_P(Torture, HardCases,
                         testing::ValuesIn(verify::tortureCases().begin(), verify::tortureCases().end()),
                         [](const auto& info) { return std::string(info.param.id); });

TEST(HardCaseTable, RowsAreInOrder)
{
    for (const auto cases : {verify::hardCases(), verify::tortureCases()}) {
        int row = 0;
        for (const HardCase& c : cases) EXPECT_EQ(c.row, ++row) << c.id;
    }
}

}  // namespace
