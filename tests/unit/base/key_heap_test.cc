#include "core/base/key_heap.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace rilievo {
namespace {

TEST(KeyHeapTest, KeysAreInTheOrderOfValuesThenOfIndices) {
  EXPECT_LT(KeyHeap::KeyOf(0.0f, 3), KeyHeap::KeyOf(0.0f, 4));
  EXPECT_LT(KeyHeap::KeyOf(0.25f, 7), KeyHeap::KeyOf(1e-3f + 0.25f, 0));
  EXPECT_LT(KeyHeap::KeyOf(0.99f, 7), KeyHeap::KeyOf(1e30f, 0));
  const uint64_t key = KeyHeap::KeyOf(0.125f, 2147483647);
  EXPECT_EQ(KeyHeap::ValueOf(key), 0.125f);
  EXPECT_EQ(KeyHeap::IndexOf(key), 2147483647);
}

TEST(KeyHeapTest, TheLeastComesFirst) {
  std::mt19937 random(7);
  for (const int count : {0, 1, 2, 4, 5, 6, 21, 1000}) {
    KeyHeap heap;
    std::multiset<uint64_t> expected;
    for (int i = 0; i < count; ++i) {
      const uint64_t key = random() % 500;
      heap.Append(key);
      expected.insert(key);
    }
    heap.Order();
    for (int step = 0; !expected.empty(); ++step) {
      ASSERT_EQ(heap.First(), *expected.begin());
      ASSERT_EQ(heap.Pop(), *expected.begin());
      expected.erase(expected.begin());
      for (int pushed = step < 500 ? random() % 3 : 0; pushed > 0; --pushed) {
        const uint64_t key = random() % 500;
        heap.Push(key);
        expected.insert(key);
      }
      ASSERT_EQ(heap.empty(), expected.empty());
    }
  }
}

}  // namespace
}  // namespace rilievo
