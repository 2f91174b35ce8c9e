// Least, greatest and middle values, against sorting.
#include "base/order_statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace meniscus {
namespace {

void expect_as_sorted(std::vector<float> values) {
  const Bounds bounds = bounds_of(values);
  const float median = median_of(values);
  std::sort(values.begin(), values.end());
  EXPECT_EQ(bounds.least, values.front());
  EXPECT_EQ(bounds.most, values.back());
  EXPECT_EQ(median, values[values.size() / 2]);
}

TEST(OrderStatistics, AreThoseOfSortedValues) {
  std::mt19937 random(1);
  for (const std::size_t n : {1, 2, 7, 8, 9, 100, 4095, 4096, 5000, 40000}) {
    std::vector<float> values(n);
    for (float& value : values) value = static_cast<float>(random() % 100000) - 50000;
    expect_as_sorted(values);
    for (float& value : values) value = static_cast<float>(random() % 3);  // most are equal
    expect_as_sorted(values);
    std::sort(values.begin(), values.end());
    expect_as_sorted(values);
  }
}

TEST(OrderStatistics, AMedianDoesNotDependOnWhatASampleHolds) {
  // Every sixteenth value is large, and then small, whatever the others are.
  for (const float odd : {1000.0f, -1000.0f}) {
    std::vector<float> values(8000);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = i % 16 == 0 ? odd : static_cast<float>(i % 101);
    expect_as_sorted(values);
  }
}

TEST(OrderStatistics, NothingHasNoBounds) {
  const Bounds bounds = bounds_of({});
  EXPECT_EQ(bounds.least, INFINITY);
  EXPECT_EQ(bounds.most, -INFINITY);
}

}  // namespace
}  // namespace meniscus
