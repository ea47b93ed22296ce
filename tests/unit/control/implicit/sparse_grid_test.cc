#include "core/control/implicit/sparse_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>

namespace rilievo {
namespace {

TEST(SparseGridTest, HoldsJustTheNodesOfTheBoxesAdded) {
  SparseGrid grid;
  std::set<std::tuple<int, int, int>> truth;
  const auto add = [&](Eigen::Vector3i low, Eigen::Vector3i high) {
    grid.AddBox(low, high);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) truth.insert({x, y, z});
      }
    }
  };
  add({-7, -3, 0}, {2, 5, 9});
  add({1, 1, 1}, {3, 3, 3});
  add({100, -200, 300}, {100, -200, 300});
  grid.Seal();
  ASSERT_EQ(grid.size(), static_cast<int>(truth.size()));
  for (int x = -10; x <= 6; ++x) {
    for (int y = -6; y <= 8; ++y) {
      for (int z = -3; z <= 12; ++z) {
        EXPECT_EQ(grid.Find({x, y, z}) >= 0, truth.count({x, y, z}) == 1);
      }
    }
  }
}

TEST(SparseGridTest, NumbersAndCoordinatesAgree) {
  SparseGrid grid;
  for (int i = 0; i < 500; ++i) grid.AddBox({7 * i, -3 * i, i}, {7 * i + 2, -3 * i + 2, i + 2});
  grid.Seal();
  const std::vector<Eigen::Vector3i> nodes = grid.Nodes();
  ASSERT_EQ(static_cast<int>(nodes.size()), grid.size());
  for (int n = 0; n < grid.size(); ++n) EXPECT_EQ(grid.Find(nodes[n]), n);
}

TEST(SparseGridTest, ManyNodesAreFoundAsOneByOne) {
  SparseGrid grid;
  grid.AddBox({-5, -5, -5}, {3, 2, 6});
  grid.AddBox({3, -9, 1}, {9, -4, 2});
  grid.Seal();
  std::array<int, 27> nodes;
  std::array<int, 8> corners;
  SparseGridReader reader(grid);
  for (int x = -8; x <= 8; ++x) {
    for (int y = -8; y <= 8; ++y) {
      for (int z = -8; z <= 8; ++z) {
        const bool any = reader.FindThreeCubed({x, y, z}, &nodes);
        EXPECT_EQ(any, *std::max_element(nodes.begin(), nodes.end()) >= 0);
        for (int n = 0; n < 27; ++n) {
          EXPECT_EQ(nodes[n], grid.Find({x + n % 3, y + n / 3 % 3, z + n / 9}));
        }
        const bool whole = reader.FindCell({x, y, z}, &corners);
        EXPECT_EQ(whole, *std::min_element(corners.begin(), corners.end()) >= 0);
        for (int c = 0; c < 8; ++c) {
          EXPECT_EQ(corners[c], grid.Find({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)}));
        }
      }
    }
  }
}

TEST(SparseGridTest, NeighborsAreThoseThatAreFoundOneByOne) {
  SparseGrid grid;
  grid.AddBox({-5, -5, -5}, {3, 2, 6});
  grid.AddBox({3, -9, 1}, {9, -4, 2});
  for (int i = 0; i < 50; ++i) grid.AddBox({5 * i, i, -i}, {5 * i, i + 1, -i});
  grid.Seal();
  const std::vector<Eigen::Vector3i> nodes = grid.Nodes();
  const SparseGridNeighbors neighbors(grid, {});
  // From within blocks to within blocks too.
  for (const int step : {1, 7, 64, grid.size()}) {
    int seen = 0;
    for (int begin = 0; begin < grid.size(); begin += step) {
      neighbors.ForEach(begin, std::min(begin + step, grid.size()),
                        [&](int node, const std::array<int, 6>& around) {
                          EXPECT_EQ(node, seen++);
                          for (int side = 0; side < 6; ++side) {
                            Eigen::Vector3i beside = nodes[node];
                            beside[side / 2] += side % 2 == 0 ? -1 : 1;
                            const int found = grid.Find(beside);
                            EXPECT_EQ(around[side], found < 0 ? grid.size() : found);
                          }
                        });
    }
    EXPECT_EQ(seen, grid.size());
  }
}

TEST(SparseGridTest, AnEmptyGridFindsNothing) {
  SparseGrid grid;
  grid.Seal();
  EXPECT_EQ(grid.size(), 0);
  EXPECT_EQ(grid.Find({0, 0, 0}), -1);
}

}  // namespace
}  // namespace rilievo
