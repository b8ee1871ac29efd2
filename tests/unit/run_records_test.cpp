// Lists in the records of a run, which may come from anybody: what they name lies in the folder, and numbers fit.
#include "run_records.h"

#include <vdbfrac/base/error.h>

#include <gtest/gtest.h>

#include <string>

using namespace vdbfrac;

namespace {

/// What is said against a list of one frame; empty: it is taken.
std::string saidOfFrame(const std::string& frame, const std::string& path)
{
    core::Archive archive;
    archive.putText("frames", R"([{"frame": )" + frame + R"(, "time": 0.5, "state_hash": "1", "files": [{"path": ")" +
                                  path + R"(", "bytes": 5, "xxh3": "2"}]}])");
    try {
        EXPECT_EQ(core::loadFrames(archive).size(), 1u);
        return "";
    } catch (const FileError& e) {
        return e.what();
    }
}

std::string saidOfBranch(const std::string& frame, const std::string& step)
{
    core::Archive archive;
    archive.putText("branches", R"([{"frame": )" + frame + R"(, "step": )" + step + R"(, "from": "", "changes": []}])");
    try {
        EXPECT_EQ(core::branchesOf(archive).size(), 1u);
        return "";
    } catch (const FileError& e) {
        return e.what();
    }
}

TEST(RunRecords, FilesOutsideOfTheFolderAreRefused)
{
    EXPECT_EQ(saidOfFrame("3", "obj/a.0003.obj"), "");
    EXPECT_EQ(saidOfFrame("3", "obj/..a.obj"), "");
    for (const char* path : {"../a.obj", "/tmp/a.obj", "obj/../../a.obj", "obj/..", ""})
        EXPECT_NE(saidOfFrame("3", path).find("outside of the run's folder"), std::string::npos) << path;
}

TEST(RunRecords, NumbersOfFramesAndStepsAreWholeAndFit)
{
    for (const char* wrong : {"-1", "1.5", "1e300", "1099511627776", "18446744073709551615", "\"3\""})
        EXPECT_NE(saidOfFrame(wrong, "obj/a.obj"), "") << wrong;
    EXPECT_EQ(saidOfBranch("-1", "0"), "");  // before the first frame
    for (const char* wrong : {"-2", "1.5", "1e300", "1099511627776", "18446744073709551615", "\"3\""}) {
        EXPECT_NE(saidOfBranch(wrong, "0"), "") << wrong;
        EXPECT_NE(saidOfBranch("3", wrong), "") << wrong;
    }
}

}  // namespace
