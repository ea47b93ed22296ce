#include "core/points/morton_order.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

TEST(MortonOrderTest, CodeInterleavesTheBits) {
  Random random(1);
  for (int round = 0; round < 200; ++round) {
    uint32_t cell[3];
    for (uint32_t& c : cell) c = static_cast<uint32_t>(random.Below(1u << kMortonBits));
    uint64_t expected = 0;
    for (int bit = 0; bit < kMortonBits; ++bit) {
      for (int axis = 0; axis < 3; ++axis) {
        expected |= static_cast<uint64_t>(cell[axis] >> bit & 1) << (3 * bit + axis);
      }
    }
    ASSERT_EQ(MortonCode(cell[0], cell[1], cell[2]), expected);
  }
}

TEST(MortonOrderTest, CellsCoverTheUnitFrameAndClamp) {
  constexpr uint32_t kLast = (1u << kMortonBits) - 1;
  EXPECT_EQ(MortonCell(-0.5), 0u);
  EXPECT_EQ(MortonCell(-7.0), 0u);
  EXPECT_EQ(MortonCell(0.5), kLast);
  EXPECT_EQ(MortonCell(7.0), kLast);
  EXPECT_EQ(MortonCell(0.0), 1u << (kMortonBits - 1));
}

TEST(MortonOrderTest, IsAPermutationSortedByCodeThenCoordinates) {
  const Eigen::Matrix3Xd points = 0.5 * SphereCloud(5000, 2).cloud.points;
  const auto morton = ComputeMortonOrder(points, RunContext{});
  ASSERT_TRUE(morton.ok());
  EXPECT_TRUE(std::is_sorted(morton->codes.begin(), morton->codes.end()));
  std::vector<int> seen = morton->order;
  std::sort(seen.begin(), seen.end());
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(seen[i], i);
}

TEST(MortonOrderTest, PointsOfOneCellAreOrderedByCoordinates) {
  Eigen::Matrix3Xd points(3, 3);
  points << 2e-9, 1e-9, 1e-9, 0, 1e-9, 0, 0, 0, 0;
  const auto morton = ComputeMortonOrder(points, RunContext{});
  ASSERT_TRUE(morton.ok());
  EXPECT_EQ(morton->order, (std::vector<int>{2, 1, 0}));
}

}  // namespace
}  // namespace rilievo
