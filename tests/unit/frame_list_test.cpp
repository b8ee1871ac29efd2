// Lists of frames, and names of sequences.
#include <vdbfrac/base/error.h>
#include <vdbfrac/cli/frame_list.h>

#include <gtest/gtest.h>

#include <string>

using namespace vdbfrac;
using namespace vdbfrac::cli;

TEST(FrameList, ReadsRangesStepsAndLists)
{
    EXPECT_EQ(parseFrames("3"), (std::vector<int>{3}));
    EXPECT_EQ(parseFrames("1-4"), (std::vector<int>{1, 2, 3, 4}));
    EXPECT_EQ(parseFrames("1-8x3"), (std::vector<int>{1, 4, 7}));
    EXPECT_EQ(parseFrames("12,5,9"), (std::vector<int>{12, 5, 9}));
    EXPECT_EQ(parseFrames("1-2,10-20x5"), (std::vector<int>{1, 2, 10, 15, 20}));
    EXPECT_EQ(parseFrames("8,1-3,2,8"), (std::vector<int>{8, 1, 2, 3}));
}

TEST(FrameList, RefusesAnythingElse)
{
    for (const char* text :
         {"", "a", "1-", "-3", "5-1", "1-9x0", "1-9x", "1,,2", "1,", "1 2", "1-2-3", "99999999999", "0-99999999"})
        EXPECT_THROW(parseFrames(text), InputError) << text;
}

TEST(FrameList, NamesTheMostFramesOfAList)
{
    EXPECT_EQ(parseFrames("1-100000").size(), 100000u);
    EXPECT_EQ(parseFrames("1-10000000x100").size(), 100000u);
    for (const char* text : {"1-100001", "1-10000000", "1-60000,1-60000"}) {
        try {
            parseFrames(text);
            ADD_FAILURE() << text;
        } catch (const InputError& e) {
            EXPECT_NE(std::string(e.what()).find("up to 100000"), std::string::npos) << e.what();
        }
    }
}

TEST(FrameList, ReadsOneFrame)
{
    EXPECT_EQ(parseFrame("0"), 0);
    EXPECT_EQ(parseFrame("96"), 96);
    for (const char* text : {"", "a", "-1", "-0", "4x", " 4", "4294967300"})
        EXPECT_EQ(parseFrame(text), std::nullopt) << text;
}

TEST(FrameNames, FillEveryKindOfPlace)
{
    EXPECT_EQ(frameName("a.####.vdb", 7), "a.0007.vdb");
    EXPECT_EQ(frameName("a.$F4.vdb", 7), "a.0007.vdb");
    EXPECT_EQ(frameName("a.$F.vdb", 7), "a.7.vdb");
    EXPECT_EQ(frameName("a.%04d.vdb", 7), "a.0007.vdb");
    EXPECT_EQ(frameName("a.%d.vdb", 12345), "a.12345.vdb");
    EXPECT_EQ(frameName("a.##.vdb", 12345), "a.12345.vdb");
    EXPECT_EQ(frameName("##/a.###", 5), "05/a.005");
    for (const char* name : {"a.$F12.obj", "a.$F0.obj", "a.%010d.obj"})
        EXPECT_THROW((void)frameName(name, 5), InputError) << name;
}

TEST(FrameNames, LeaveOtherNamesAlone)
{
    for (const char* name : {"a.vdb", "100%.vdb", "$HOME.vdb", "%5d", "a%", "$"}) {
        EXPECT_FALSE(isSequence(name)) << name;
        EXPECT_EQ(frameName(name, 3), name);
    }
}
