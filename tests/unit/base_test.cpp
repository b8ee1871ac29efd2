// Ground floor: errors, ledgers, fingerprints.
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/ledger.h>
#include <vdbfrac/base/number_text.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

using namespace vdbfrac;
namespace fs = std::filesystem;

namespace {

TEST(Errors, InputErrorTellsTheFirstOfMany)
{
    const InputError error(std::vector<InputError::Detail>(25, {"a.toml:1:1", "is wrong", "", ""}));
    const std::string said = error.what();
    EXPECT_EQ(std::ranges::count(said, '\n'), 20) << said;
    EXPECT_TRUE(said.ends_with("\nand 5 more")) << said;
    EXPECT_EQ(error.details().size(), 25u);
}

TEST(Errors, InputErrorSaysPlaceWhatAllowedAndHint)
{
    const InputError error(std::vector<InputError::Detail>{
        {"a.toml:3:1", "nu is 0.7", "-1 < nu < 0.5", "rubber has 0.49"}, {"b", "c", "", ""}});
    const std::string text = error.what();
    for (const char* part : {"a.toml:3:1", "nu is 0.7", "-1 < nu < 0.5", "rubber has 0.49", "b: c"})
        EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(error.details().size(), 2u);
}

TEST(Csv, CellsAreReadAsTheyWere)
{
    const std::vector<std::string> cells = {"time_s", "load_left, upper_x_N", "say \"so\"", "", "\"", "end"};
    std::string line = csvCell(cells[0]);
    for (std::size_t k = 1; k < cells.size(); ++k) line += "," + csvCell(cells[k]);
    EXPECT_EQ(csvCells(line), cells);
    EXPECT_EQ(csvCell("load_left_x_N"), "load_left_x_N");
    EXPECT_EQ(csvCell("a,\"b\""), "\"a,\"\"b\"\"\"");
}

TEST(Ledger, CountsAddUpAndStagesKeepTheirOrder)
{
    Ledger ledger;
    EXPECT_EQ(ledger.countOf("cut", "cells"), 0);
    EXPECT_TRUE(ledger.stages().empty());  // asking makes no stage
    ledger.count("solve", "calls", 1);
    ledger.count("cut", "cells", 10);
    ledger.count("cut", "cells", 5);
    ledger.count("cut", "voxels", 0);
    ledger.addSeconds("solve", 1.5);
    EXPECT_EQ(ledger.countOf("cut", "cells"), 15);
    EXPECT_EQ(ledger.countOf("cut", "voxels"), 0);
    EXPECT_EQ(ledger.secondsOf("solve"), 1.5);
    ASSERT_EQ(ledger.stages().size(), 2u);
    EXPECT_EQ(ledger.stages()[0].name, "solve");
    EXPECT_EQ(ledger.stages()[1].name, "cut");

    Ledger all;
    all.count("cut", "cells", 1);
    all.add(ledger);
    all.add(ledger);
    EXPECT_EQ(all.countOf("cut", "cells"), 31);
    EXPECT_EQ(all.countOf("solve", "calls"), 2);
    EXPECT_EQ(all.secondsOf("solve"), 3);
    EXPECT_EQ(all.stages()[0].name, "cut");
    {
        const StageTimer timer(all, "write");
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_EQ(all.countOf("write", "calls"), 1);
    EXPECT_GT(all.secondsOf("write"), 0);
    all.clear();
    EXPECT_TRUE(all.stages().empty());
}

TEST(Hash, IsXxh3AndDoesNotChange)
{
    // Published test values of XXH3, 64 bits, seed 0. Files carry these hashes: they must be the same for ever.
    EXPECT_EQ(hashBytes("", 0), 0x2d06800538d394c2u);
    EXPECT_EQ(hexadecimal(hashBytes("", 0)), "2d06800538d394c2");
    EXPECT_EQ(hexadecimal(0x1f), "000000000000001f");
    EXPECT_EQ(hexadecimal(~std::uint64_t{0}), "ffffffffffffffff");
}

TEST(Hash, OfAFileIsThatOfItsPieces)
{
    const fs::path file = fs::path(testing::TempDir()) / "hash_of_a_file";
    constexpr std::size_t kPiece = 1 << 20;
    const std::string text = std::string(kPiece, 'a') + "b";
    std::ofstream(file, std::ios::binary) << text;
    EXPECT_EQ(hashFile(file, 3), hashBytes("b", 1, hashBytes(text.data(), kPiece, 3)));
    std::ofstream(file, std::ios::binary) << "";
    EXPECT_EQ(hashFile(file, 3), 3u);
    fs::remove(file);
    EXPECT_THROW((void)hashFile(file), FileError);
}

TEST(Hash, SeesEveryBitOrderAndSeed)
{
    std::vector<double> values;
    for (int i = 0; i < 1000; ++i) values.push_back(std::sin(i));
    const auto hash = [&](std::uint64_t seed = 0) { return hashOf(std::span<const double>(values), seed); };
    const std::uint64_t first = hash();
    EXPECT_EQ(hash(), first);
    EXPECT_NE(hash(1), first);
    values[500] = std::nextafter(values[500], 1e300);
    EXPECT_NE(hash(), first);
    values[500] = std::nextafter(values[500], -1e300);
    EXPECT_EQ(hash(), first);
    std::swap(values[1], values[2]);
    EXPECT_NE(hash(), first);
    EXPECT_NE(hashOf(std::span<const double>(std::vector<double>{0.})),
              hashOf(std::span<const double>(std::vector<double>{-0.})));
}

}  // namespace
