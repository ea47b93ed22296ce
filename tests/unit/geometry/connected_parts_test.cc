#include "core/geometry/connected_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/geometry/vertex_ring.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;

// A path of six nodes, of which the fourth is not marked.
TEST(ConnectedParts, AreNumberedByTheirFirstNodes) {
  int parts = 0;
  const auto neighbors = [](int node) {
    return std::vector<int>{node - 1, node < 5 ? node + 1 : -1};
  };
  EXPECT_THAT(ConnectedParts({1, 1, 1, 0, 1, 1}, neighbors, &parts),
              ElementsAre(0, 0, 0, -1, 1, 1));
  EXPECT_EQ(parts, 2);
}

TEST(ConnectedParts, ThereAreNoneOfNothing) {
  int parts = 1;
  EXPECT_THAT(ConnectedParts(
                  {0, 0}, [](int) { return std::vector<int>{}; }, &parts),
              ElementsAre(-1, -1));
  EXPECT_EQ(parts, 0);
}

TEST(RingOf, HoldsTheNeighborsOfOneVertex) {
  const VertexRings rings{.neighbor_begin = {0, 2, 2, 5}, .neighbors = {1, 2, 0, 1, 3}};
  EXPECT_THAT(RingOf(rings, 0), ElementsAre(1, 2));
  EXPECT_THAT(RingOf(rings, 1), ElementsAre());
  EXPECT_THAT(RingOf(rings, 2), ElementsAre(0, 1, 3));
}

}  // namespace
}  // namespace rilievo
