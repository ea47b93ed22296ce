#include "core/booleans/box_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace rilievo {
namespace {

FloatBox RandomBox(float longest, std::mt19937& random) {
  std::uniform_real_distribution<float> at(0, 1), length(0, longest);
  FloatBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = at(random);
    box.hi[axis] = box.lo[axis] + length(random);
  }
  return box;
}

std::vector<int> Found(const BoxTree& tree, const FloatBox& box) {
  std::vector<int> found;
  tree.ForEachOverlap(box, [&](int item) { found.push_back(item); });
  std::sort(found.begin(), found.end());
  return found;
}

TEST(BoxTreeTest, FindsWhatASearchOfAllFinds) {
  std::mt19937 random(1);
  int hits = 0;
  for (const int count : {1, 3, 5, 64, 777}) {
    std::vector<FloatBox> boxes;
    for (int i = 0; i < count; ++i) boxes.push_back(RandomBox(0.2f, random));
    const BoxTree tree(boxes);
    for (int query = 0; query < 100; ++query) {
      const FloatBox box = RandomBox(0.3f, random);
      std::vector<int> expected;
      for (int i = 0; i < count; ++i) {
        bool apart = false;
        for (int axis = 0; axis < 3; ++axis) {
          apart = apart || boxes[i].hi[axis] < box.lo[axis] || box.hi[axis] < boxes[i].lo[axis];
        }
        if (!apart) expected.push_back(i);
      }
      EXPECT_EQ(Found(tree, box), expected);
      hits += static_cast<int>(expected.size());
    }
  }
  EXPECT_GT(hits, 1000);
}

TEST(BoxTreeTest, BoxesThatTouchOverlap) {
  const FloatBox a{{0, 0, 0}, {1, 1, 1}}, b{{1, 1, 1}, {2, 2, 2}}, c{{1.5f, 0, 0}, {2, 1, 1}};
  const BoxTree tree({a, a, a, a, a, c});
  EXPECT_EQ(Found(tree, b), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_TRUE(Found(tree, {{1.1f, 0, 0}, {1.4f, 1, 1}}).empty());
}

TEST(BoxTreeTest, WithoutBoxesNothingIsFound) {
  EXPECT_TRUE(Found(BoxTree({}), {{0, 0, 0}, {1, 1, 1}}).empty());
}

}  // namespace
}  // namespace rilievo
