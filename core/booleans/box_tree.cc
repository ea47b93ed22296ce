#include "core/booleans/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace rilievo {

BoxTree::BoxTree(std::vector<FloatBox> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(boxes_.size());
  if (!boxes_.empty()) BuildNode(0, static_cast<int>(boxes_.size()));
}

int BoxTree::BuildNode(int begin, int end) {
  const auto index = static_cast<int>(nodes_.size());
  Node node{{}, begin, end};
  for (int i = begin; i < end; ++i) {
    node.box.Add(boxes_[static_cast<size_t>(order_[static_cast<size_t>(i)])]);
  }
  nodes_.push_back(node);
  if (end - begin <= kInLeaf) return index;
  int axis = 0;
  const auto side = [&](int k) { return node.box.hi[k] - node.box.lo[k]; };
  for (int k = 1; k < 3; ++k) axis = side(k) > side(axis) ? k : axis;
  const int middle = begin + (end - begin) / 2;
  const auto center = [&](int item) {
    const FloatBox& box = boxes_[static_cast<size_t>(item)];
    return box.lo[axis] + box.hi[axis];
  };
  std::nth_element(
      order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
      [&](int a, int b) { return center(a) < center(b) || (center(a) == center(b) && a < b); });
  const int left = BuildNode(begin, middle), right = BuildNode(middle, end);
  nodes_[static_cast<size_t>(index)].left = left;
  nodes_[static_cast<size_t>(index)].right = right;
  return index;
}

}  // namespace rilievo
