#include "core/base/quantile.h"

#include <gtest/gtest.h>

#include <vector>

namespace rilievo {
namespace {

TEST(QuantileTest, IsThePlaceInOrder) {
  const std::vector<double> values = {4, 1, 3, 5, 2};
  EXPECT_EQ(Quantile(values, 0), 1);
  EXPECT_EQ(Quantile(values, 0.25), 2);
  EXPECT_EQ(Quantile(values, 0.49), 2);
  EXPECT_EQ(Median(values), 3);
  EXPECT_EQ(Quantile(values, 1), 5);
  EXPECT_EQ(Median(std::vector<int>{7, 2}), 2);
}

TEST(QuantileTest, ZeroOfNothing) { EXPECT_EQ(Median(std::vector<float>()), 0); }

}  // namespace
}  // namespace rilievo
