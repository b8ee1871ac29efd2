// Tests with a folder of their own.
#pragma once

#include <vdbfrac/base/atomic_file.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include <unistd.h>

namespace vdbfrac::test {

/// An empty folder for each test, removed with all that is in it.
class FolderTest : public testing::Test {
protected:
    void SetUp() override
    {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ =
            std::filesystem::path(testing::TempDir()) / ("vdbfrac-" + std::to_string(::getpid()) + "-" + info->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path write(const std::string& name, const std::string& content) const
    {
        writeText(folder_ / name, content);
        return folder_ / name;
    }

    std::filesystem::path folder_;
};

}  // namespace vdbfrac::test
