#include "core/points/neighborhood_size.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(NeighborhoodSizeTest, MoreWhereNoisierWithinBounds) {
  EXPECT_EQ(NeighborhoodSize(48, 192, 0, 0.01), 48);
  EXPECT_EQ(NeighborhoodSize(48, 192, 0.005, 0.01), 192);  // 48 * 4
  EXPECT_EQ(NeighborhoodSize(48, 192, 0.0025, 0.01), 84);  // 48 * 1.75
  EXPECT_EQ(NeighborhoodSize(48, 192, 1, 0.01), 192);
}

TEST(NeighborhoodSizeTest, WithoutSpacingTheFewest) {
  EXPECT_EQ(NeighborhoodSize(48, 192, 0.1, 0), 48);
}

}  // namespace
}  // namespace rilievo
