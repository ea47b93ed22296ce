#include "core/control/simplify/edge_queue.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <utility>

namespace rilievo {
namespace {

TEST(EdgeQueueTest, EdgesComeByCostThenByNumber) {
  std::mt19937 random(7);
  // Few different costs: many are equal.
  const auto cost = [&] { return static_cast<float>(random() % 50) / 8; };
  for (const int count : {0, 1, EdgeQueue::kLine - 1, EdgeQueue::kLine, 1000}) {
    EdgeQueue queue;
    std::set<std::pair<float, int>> expected;
    for (int edge = 0; edge < count; ++edge) {
      const float value = cost();
      queue.Append(value, edge);
      expected.insert({value, edge});
    }
    queue.Order();
    for (int step = 0, next = count; !expected.empty(); ++step) {
      int before = 0;
      for (auto it = expected.begin(); it != expected.end() && before < EdgeQueue::kLine; ++it) {
        ASSERT_EQ(queue.Edge(before++), it->second);
      }
      if (before < EdgeQueue::kLine) {
        ASSERT_EQ(queue.Edge(before), -1);
      }
      queue.RemoveFirst();
      expected.erase(expected.begin());
      for (int pushed = random() % 3; pushed > 0 && step < 500; --pushed) {
        const float value = cost();
        queue.Push(value, next);
        expected.insert({value, next++});
      }
      ASSERT_EQ(queue.empty(), expected.empty());
    }
    queue.Push(0, 5);
    queue.Clear();
    EXPECT_TRUE(queue.empty());
  }
}

}  // namespace
}  // namespace rilievo
