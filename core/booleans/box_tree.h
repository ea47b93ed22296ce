// A tree of boxes, asked which of them overlap another.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/four_boxes.h"

namespace rilievo {

// Split at the median of the longest side, down to kInLeaf boxes. Boxes of float, rounded outward
// by who makes them.
class BoxTree {
 public:
  explicit BoxTree(std::vector<FloatBox> boxes);

  // Calls visit(i) for each box i that shares a point with `box`.
  template <typename Visit>
  void ForEachOverlap(const FloatBox& box, const Visit& visit) const {
    if (!nodes_.empty()) Descend(0, box, visit);
  }

 private:
  static constexpr int kInLeaf = 4;
  struct Node {
    FloatBox box;
    int begin, end;  // of order_
    int left = -1, right = -1;
  };

  static bool Overlap(const FloatBox& a, const FloatBox& b) {
    for (int axis = 0; axis < 3; ++axis) {
      if (a.lo[axis] > b.hi[axis] || b.lo[axis] > a.hi[axis]) return false;
    }
    return true;
  }
  template <typename Visit>
  void Descend(int index, const FloatBox& box, const Visit& visit) const {
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (!Overlap(node.box, box)) return;
    if (node.left >= 0) {
      Descend(node.left, box, visit);
      Descend(node.right, box, visit);
      return;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const int item = order_[static_cast<size_t>(i)];
      if (Overlap(boxes_[static_cast<size_t>(item)], box)) visit(item);
    }
  }
  int BuildNode(int begin, int end);

  std::vector<FloatBox> boxes_;
  std::vector<int> order_;
  std::vector<Node> nodes_;  // node 0 is the root
};

}  // namespace rilievo
