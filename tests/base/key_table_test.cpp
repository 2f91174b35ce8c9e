// Numbers for keys.
#include "base/key_table.hpp"

#include <gtest/gtest.h>

#include <random>
#include <unordered_map>

namespace meniscus {
namespace {

TEST(KeyTable, NumbersKeysAsTheyComeFirst) {
  std::mt19937_64 random(1);
  KeyTable table;
  EXPECT_EQ(table.find(0), KeyTable::kNone);
  std::unordered_map<std::uint64_t, std::uint32_t> expected;
  for (int k = 0; k < 20000; ++k) {
    // Keys of few bits, low or high ones, and many again.
    const std::uint64_t key = random() % 4096 << (k % 2 ? 0 : 52);
    const std::uint32_t next = static_cast<std::uint32_t>(expected.size());
    const std::uint32_t number = expected.try_emplace(key, next).first->second;
    EXPECT_EQ(table.add(key), number);
  }
  EXPECT_EQ(table.size(), expected.size());
  for (const auto& [key, number] : expected) EXPECT_EQ(table.find(key), number);
  EXPECT_EQ(table.find(1u << 20), KeyTable::kNone);
}

}  // namespace
}  // namespace meniscus
