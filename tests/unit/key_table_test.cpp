#include <vdbfrac/base/key_table.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <random>
#include <vector>

using vdbfrac::KeyTable;

namespace {

TEST(KeyTable, FindsTheFirstRowOfEachKey)
{
    std::mt19937_64 random(1);
    std::vector<std::uint64_t> keys{0, ~std::uint64_t{0}};
    // Keys of places differ in few bits, and come several times.
    for (int i = 0; i < 5000; ++i) keys.push_back(random() % 2000 << 32 | random() % 2);
    KeyTable table(keys);
    EXPECT_EQ(table.find(keys[0]), KeyTable::kNone);
    std::map<std::uint64_t, std::uint32_t> first;
    for (std::uint32_t row = 0; row < keys.size(); ++row)
        EXPECT_EQ(table.add(row), first.emplace(keys[row], row).first->second);
    for (const auto& [key, row] : first) EXPECT_EQ(table.find(key), row);
    EXPECT_EQ(table.find(5), KeyTable::kNone);
}

TEST(KeyTable, OfNothingFindsNothing) { EXPECT_EQ(KeyTable({}).find(1), KeyTable::kNone); }

}  // namespace
