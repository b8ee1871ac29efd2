// Times as users and queues write them.
#include "stop_request.h"

#include <vdbfrac/base/error.h>

#include <gtest/gtest.h>

using vdbfrac::cli::parseDuration;

TEST(Durations, AreReadInUnitsAndOnTheClock)
{
    EXPECT_EQ(parseDuration("--t", "45s"), 45);
    EXPECT_EQ(parseDuration("--t", "3h50m"), 13800);
    EXPECT_EQ(parseDuration("--t", "1d2h"), 93600);
    EXPECT_EQ(parseDuration("--t", "0.5s"), .5);
    EXPECT_EQ(parseDuration("--t", "01:30:05"), 5405);
    EXPECT_EQ(parseDuration("--t", "2-12:00:00"), 216000);
}

TEST(Durations, OthersAreRefused)
{
    for (const char* text : {"", "5", "a while", "5s3h", "-5s", "0s", "00:00:00", "1:30", "1:2:3x", "1-2", "1e999s",
                             "nans", "-1:00:00", "1:99:00", "1:00:-5", "-1-00:00:00", " 1:00:00", "1e308d"})
        EXPECT_THROW(parseDuration("--t", text), vdbfrac::InputError) << text;
}
