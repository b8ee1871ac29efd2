// Files are written whole or not at all.
#include "folder_test.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <string>
#include <vector>

using namespace vdbfrac;
namespace fs = std::filesystem;

namespace {

class Files : public test::FolderTest {
protected:
    std::size_t entries() const
    {
        return std::size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }
};

TEST_F(Files, TextComesBackAsItWasWritten)
{
    std::string text = "line\r\nline\n";
    text.push_back('\0');
    text += "\xff end without newline";
    writeText(folder_ / "a.txt", text);
    EXPECT_EQ(readText(folder_ / "a.txt"), text);
    writeText(folder_ / "a.txt", "");
    EXPECT_EQ(readText(folder_ / "a.txt"), "");
    EXPECT_EQ(entries(), 1u);  // no temporary is left
}

TEST_F(Files, TwoWritersOfOneFileLeaveOneOfTheirTexts)
{
    const std::vector<std::string> texts = {std::string(1 << 18, 'a'), std::string(1 << 18, 'b')};
    const auto write = [&](const std::string& text) {
        for (int k = 0; k < 50; ++k) writeText(folder_ / "a.txt", text);
    };
    std::future<void> other = std::async(std::launch::async, write, texts[1]);
    write(texts[0]);
    other.get();  // with what it threw
    EXPECT_TRUE(readText(folder_ / "a.txt") == texts[0] || readText(folder_ / "a.txt") == texts[1]);
    EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, FailedWriteLeavesTheOldFile)
{
    const fs::path file = folder_ / "state.bin";
    writeText(file, "old");
    const auto halfWritten = [](const fs::path& temporary) {
        std::ofstream(temporary) << "ne";
        throw Error("disk full");
    };
    try {
        writeAtomically(file, halfWritten);
        FAIL() << "no error";
    } catch (const FileError& e) {
        EXPECT_NE(std::string(e.what()).find("state.bin"), std::string::npos);
        EXPECT_NE(std::string(e.what()).find("disk full"), std::string::npos);
    }
    EXPECT_EQ(readText(file), "old");
    EXPECT_EQ(entries(), 1u);
    // A writer that makes nothing is a failure as well.
    EXPECT_THROW(writeAtomically(file, [](const fs::path&) {}), FileError);
    EXPECT_EQ(readText(file), "old");
}

TEST_F(Files, FailedVerifyRemovesTheTemporary)
{
    const fs::path file = folder_ / "frame.vdb";
    fs::path seen;
    const auto write = [&](const fs::path& temporary) {
        seen = temporary;
        std::ofstream(temporary) << "damaged";
    };
    EXPECT_THROW(writeAtomically(file, write, [](const fs::path&) { throw Error("differs"); }), FileError);
    EXPECT_EQ(entries(), 0u);
    EXPECT_EQ(seen.parent_path(), folder_);         // so that renaming never copies
    EXPECT_EQ(seen.extension(), file.extension());  // writers choose their format by it
    EXPECT_NE(seen.filename(), file.filename());
}

TEST_F(Files, WhatALinkPointsToIsWritten)
{
    writeText(folder_ / "real", "old");
    fs::create_symlink("real", folder_ / "link");
    fs::create_symlink("later", folder_ / "dangling");
    writeText(folder_ / "link", "new");
    writeText(folder_ / "dangling", "made");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(readText(folder_ / "real"), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "dangling"));
    EXPECT_EQ(readText(folder_ / "later"), "made");
    fs::create_symlink("circle", folder_ / "circle");
    EXPECT_THROW(writeText(folder_ / "circle", "x"), FileError);
    EXPECT_THROW((void)readText(folder_ / "circle"), FileError);
}

TEST_F(Files, DevicesAndPipesAreNeitherReplacedNorRead)
{
    const fs::path pipe = folder_ / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    for (const fs::path& other : {pipe, fs::path("/dev/null"), fs::path("/dev/zero")}) {
        EXPECT_THROW(writeText(other, "x"), FileError) << other;
        EXPECT_THROW((void)readText(other), FileError) << other;  // and does not wait for somebody to write
    }
    EXPECT_TRUE(fs::is_fifo(pipe));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Files, AnErrorWhileReadingIsNoEnd)
{
    try {
        (void)readText("/proc/self/mem");  // page 0 cannot be read: EIO
        FAIL() << "nothing was thrown";
    } catch (const FileError& e) {
        EXPECT_NE(std::string(e.what()).find("cannot be read"), std::string::npos) << e.what();
    }
}

TEST_F(Files, NoMoreIsReadThanAllowed)
{
    writeText(folder_ / "ten", "0123456789");
    EXPECT_EQ(readText(folder_ / "ten", 10), "0123456789");
    EXPECT_THROW((void)readText(folder_ / "ten", 9), FileError);
    EXPECT_GT(readText("/proc/self/status").size(), 0u);  // says that it has 0 bytes
    EXPECT_THROW((void)readText("/proc/self/status", 9), FileError);
}

TEST_F(Files, WritingBehindKeepsWhatIsBeforeAndCutsOffWhatIsAfter)
{
    const fs::path file = folder_ / "log";
    writeBehind(file, 0, "first");
    writeBehind(file, 5, " and second");
    EXPECT_EQ(readText(file), "first and second");
    writeBehind(file, 5, "!");
    EXPECT_EQ(readText(file), "first!");
    EXPECT_THROW(writeBehind(folder_, 0, "x"), FileError);
}

TEST_F(Files, FolderInPlaceOfAFileIsRefused)
{
    fs::create_directory(folder_ / "a");
    EXPECT_THROW(writeText(folder_ / "a", "text"), FileError);
    EXPECT_TRUE(fs::is_directory(folder_ / "a"));
    EXPECT_EQ(entries(), 1u);
    EXPECT_THROW((void)readText(folder_ / "a"), FileError);
    EXPECT_THROW((void)readText(folder_ / "missing"), FileError);
    EXPECT_THROW(writeText(folder_ / "missing" / "a", "text"), FileError);
}

}  // namespace
