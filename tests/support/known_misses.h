// Tables of cases, held to their limits but for what is known to miss them.
#pragma once

#include <vdbfrac/lab/verify/hard_case.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <span>
#include <string>

namespace vdbfrac::lab::verify {
inline void PrintTo(const HardCase& c, std::ostream* out) { *out << c.id; }
}  // namespace vdbfrac::lab::verify

namespace vdbfrac::test {

/// A measurement that misses its limit today.
struct KnownMiss {
    const char* id;
    const char* what;
    double value;      ///< as measured; NaN: not a number
    double tolerance;  ///< relative: what another processor or compiler may change
};

inline void expectKnown(const lab::verify::Measurement& m, const KnownMiss& miss)
{
    EXPECT_FALSE(m.holds()) << m.what << ": holds now; take it off the list";
    if (std::isnan(miss.value))
        EXPECT_TRUE(std::isnan(m.value)) << m.what << " is " << m.value;
    else
        EXPECT_NEAR(m.value, miss.value, miss.tolerance * std::abs(miss.value)) << m.what;
}

/// Measures the quick extent of a case.
inline void expectLimits(const lab::verify::HardCase& c, std::span<const KnownMiss> misses)
{
    const auto measured = c.measure(lab::verify::Extent::quick);
    EXPECT_FALSE(measured.empty());
    for (const lab::verify::Measurement& m : measured) {
        std::printf("%s: %.4g (limit %g, reference %g)\n", m.what.c_str(), m.value, m.limit, m.reference);
        const auto miss = std::find_if(misses.begin(), misses.end(), [&](const KnownMiss& known) {
            return std::string(c.id) == known.id && m.what == known.what;
        });
        if (miss != misses.end())
            expectKnown(m, *miss);
        else
            EXPECT_TRUE(m.holds()) << m.what << " is " << m.value;
    }
}

}  // namespace vdbfrac::test
