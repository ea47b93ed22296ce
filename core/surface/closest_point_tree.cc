#include "core/surface/closest_point_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace

// Splits `centers` in place, and makes the nodes over them in the caller's memory: how many there
// are follows from the number of centers. Items that would fill a node of their own badly become a
// run of the tree's. `box_of(item)`: the box of an item.
template <typename BoxOfItem>
class ClosestPointTree::Builder {
 public:
  Builder(const ClosestPointTree& tree, const BoxOfItem& box_of, int children_per_face,
          const RunContext& context, std::vector<Center>& centers)
      : tree_(tree),
        box_of_(box_of),
        children_per_face_(children_per_face),
        context_(context),
        centers_(centers) {
    for (int count = children_per_face; count > tree.most_in_run(); count /= kWidth) {
      nodes_of_face_ += children_per_face / count;
    }
  }

  // How many nodes Split makes over `count` centers.
  int CountNodes(int count) {
    int nodes = 1;
    int part_begin[kWidth + 1];
    PlanCut(count, part_begin);
    for (int slot = 0; slot < kWidth; ++slot) {
      const int part = part_begin[slot + 1] - part_begin[slot];
      if (part == 1) nodes += nodes_of_face_;
      if (part <= 1 || IsRun(part)) continue;
      const auto known = counted_.find(part);
      const int below = known != counted_.end() ? known->second : CountNodes(part);
      counted_.emplace(part, below);
      nodes += below;
    }
    return nodes;
  }

  // The nodes over centers [begin, end), at least one; the first is the root. `next`: where in
  // `nodes` they go; then where the next one goes. Returns the box of all. Unfinished once a stop
  // was requested.
  FloatBox Split(int begin, int end, std::vector<Node>& nodes, int32_t* next) const {
    const int at = (*next)++;
    nodes[at] = EmptyNode();
    if (context_.stop.stop_requested()) return FloatBox();
    int part_begin[kWidth + 1];
    Cut(begin, end, part_begin);
    FloatBox all;
    for (int slot = 0; slot < kWidth; ++slot) {
      const int from = part_begin[slot], to = part_begin[slot + 1];
      if (from == to) continue;
      FloatBox part;
      if (to - from == 1) {
        int32_t child = 0;
        part = Place(from * children_per_face_, centers_[from].face * children_per_face_,
                     children_per_face_, nodes, next, &child);
        nodes[at].child[slot] = child;
      } else if (IsRun(to - from)) {
        nodes[at].child[slot] = tree_.ChildOf({from, to - from});
        for (int i = from; i < to; ++i) part.Add(box_of_(centers_[i].face));
      } else {
        nodes[at].child[slot] = *next;
        part = Split(from, to, nodes, next);
      }
      nodes[at].boxes.Set(slot, part);
      all.Add(part);
    }
    return all;
  }

  // Where the second half of a range begins: in large ones after a multiple of four items, so that
  // most of the lowest nodes are full.
  static int HalfOf(int count) {
    const int half = (count + 1) / 2;
    return count > 2 * kWidth ? (half + kWidth - 1) / kWidth * kWidth : half;
  }

  // Halves centers [begin, end) along their longest axis; returns where the second half begins.
  int Halve(int begin, int end) const {
    const int count = end - begin, half = HalfOf(count);
    if (half >= count) return end;
    float lo[3] = {kInfinity, kInfinity, kInfinity};
    float hi[3] = {-kInfinity, -kInfinity, -kInfinity};
    for (int i = begin; i < end; ++i) {
      for (int k = 0; k < 3; ++k) {
        lo[k] = std::min(lo[k], centers_[i].at[k]);
        hi[k] = std::max(hi[k], centers_[i].at[k]);
      }
    }
    int axis = hi[1] - lo[1] > hi[0] - lo[0] ? 1 : 0;
    if (hi[2] - lo[2] > hi[axis] - lo[axis]) axis = 2;
    std::nth_element(centers_.begin() + begin, centers_.begin() + begin + half,
                     centers_.begin() + end, [axis](const Center& a, const Center& b) {
                       if (a.at[axis] != b.at[axis]) return a.at[axis] < b.at[axis];
                       return a.face < b.face;
                     });
    return begin + half;
  }

  static Node EmptyNode() {
    Node node;
    for (int slot = 0; slot < kWidth; ++slot) {
      node.boxes.Set(slot, FloatBox());
      node.child[slot] = ~0;
    }
    return node;
  }

 private:
  // The `count` items from `item` on, a power of four, in the tree's places from `place` on.
  // `child` says where they are; returns their box.
  FloatBox Place(int place, int item, int count, std::vector<Node>& nodes, int32_t* next,
                 int32_t* child) const {
    FloatBox all;
    if (count <= tree_.most_in_run()) {
      *child = tree_.ChildOf({place, count});
      for (int i = item; i < item + count; ++i) all.Add(box_of_(i));
      return all;
    }
    const int at = *child = (*next)++;
    nodes[at] = EmptyNode();
    const int quarter = count / kWidth;
    for (int slot = 0; slot < kWidth; ++slot) {
      int32_t below = 0;
      const FloatBox part =
          Place(place + slot * quarter, item + slot * quarter, quarter, nodes, next, &below);
      nodes[at].child[slot] = below;
      nodes[at].boxes.Set(slot, part);
      all.Add(part);
    }
    return all;
  }

  // Where four parts of nearly equal size begin.
  static void PlanCut(int count, int part_begin[kWidth + 1]) {
    part_begin[0] = 0;
    part_begin[kWidth] = count;
    if (count <= kWidth) {
      for (int i = 1; i < kWidth; ++i) part_begin[i] = std::min(i, count);
      return;
    }
    part_begin[2] = HalfOf(count);
    part_begin[1] = HalfOf(part_begin[2]);
    part_begin[3] = part_begin[2] + HalfOf(count - part_begin[2]);
  }

  void Cut(int begin, int end, int part_begin[kWidth + 1]) const {
    PlanCut(end - begin, part_begin);
    for (int i = 0; i <= kWidth; ++i) part_begin[i] += begin;
    if (end - begin <= kWidth) return;
    Halve(begin, end);
    Halve(begin, part_begin[2]);
    Halve(part_begin[2], end);
  }

  // Whether so many centers share a slot.
  bool IsRun(int count) const { return children_per_face_ == 1 && count <= tree_.most_in_run(); }

  const ClosestPointTree& tree_;
  const BoxOfItem& box_of_;
  const int children_per_face_;  // items
  const RunContext& context_;
  std::vector<Center>& centers_;
  int nodes_of_face_ = 0;
  std::map<int, int> counted_;  // of CountNodes
};

// A large tree has a root, its four children and their sixteen, each made by a job of its own: the
// same tree for any number of threads.
template <typename BoxOfItem>
absl::Status ClosestPointTree::BuildNodes(const BoxOfItem& box_of, int children_per_face,
                                          const RunContext& context, std::vector<Center>& centers) {
  Builder<BoxOfItem> builder(*this, box_of, children_per_face, context, centers);
  const int count = static_cast<int>(centers.size());
  constexpr int kJobs = kWidth * kWidth;
  constexpr int kSmall = 4096;  // items
  if (count <= kSmall / children_per_face || count < kWidth * kJobs) {
    int32_t next = 0;
    nodes_.resize(static_cast<size_t>(builder.CountNodes(count)));
    builder.Split(0, count, nodes_, &next);
    return context.CheckStop();
  }
  std::array<int, kJobs + 1> first;
  first[0] = 0;
  first[kJobs] = count;
  for (int parts = 1; parts < kJobs; parts *= 2) {
    const int width = kJobs / parts;
    RILIEVO_RETURN_IF_ERROR(ParallelFor(parts, 1, context, [&](int64_t begin, int64_t end) {
      for (int64_t part = begin; part < end; ++part) {
        const int64_t at = part * width;
        first[at + width / 2] = builder.Halve(first[at], first[at + width]);
      }
    }));
  }
  std::array<int32_t, kJobs> root;
  int32_t size = 1 + kWidth;
  for (int job = 0; job < kJobs; ++job) {
    root[job] = size;
    size += builder.CountNodes(first[job + 1] - first[job]);
  }
  nodes_.resize(static_cast<size_t>(size));
  std::array<FloatBox, kJobs> boxes;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(kJobs, 1, context, [&](int64_t begin, int64_t end) {
    for (int64_t job = begin; job < end; ++job) {
      int32_t next = root[job];
      boxes[job] = builder.Split(first[job], first[job + 1], nodes_, &next);
    }
  }));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  std::fill_n(nodes_.begin(), 1 + kWidth, builder.EmptyNode());
  for (int part = 0; part < kWidth; ++part) {
    FloatBox all;
    for (int slot = 0; slot < kWidth; ++slot) {
      const int job = part * kWidth + slot;
      nodes_[1 + part].child[slot] = root[job];
      nodes_[1 + part].boxes.Set(slot, boxes[job]);
      all.Add(boxes[job]);
    }
    nodes_[0].child[part] = 1 + part;
    nodes_[0].boxes.Set(part, all);
  }
  return absl::OkStatus();
}

absl::StatusOr<ClosestPointTree> ClosestPointTree::Build(Eigen::Matrix3Xd vertices,
                                                         Eigen::Matrix3Xi triangles,
                                                         const RunContext& context,
                                                         int children_per_face) {
  RILIEVO_ASSIGN_OR_RETURN(ClosestPointTree tree,
                           Over(vertices, triangles, context, children_per_face));
  tree.own_vertices_ = std::move(vertices);
  tree.own_triangles_ = std::move(triangles);
  return tree;
}

absl::StatusOr<ClosestPointTree> ClosestPointTree::Over(const Eigen::Matrix3Xd& vertices,
                                                        const Eigen::Matrix3Xi& triangles,
                                                        const RunContext& context,
                                                        int children_per_face) {
  ClosestPointTree tree;
  tree.vertices_ = vertices.data();
  tree.triangles_ = triangles.data();
  tree.points_ = triangles.cols() == 0;
  const int count = static_cast<int>(tree.points_ ? vertices.cols() : triangles.cols());
  const int corner_count = tree.points_ ? 1 : 3;
  const Vector3d lo = vertices.rowwise().minCoeff(), hi = vertices.rowwise().maxCoeff();
  tree.origin_ = lo + (hi - lo) / 2;
  const double extent = (hi - lo).maxCoeff() / 2;
  tree.box_scale_ = extent > 0 ? 1 / extent : 1;
  if (!std::isfinite(tree.box_scale_)) tree.box_scale_ = 1;

  const auto corner = [&](int item, int k) -> Vector3d {
    return vertices.col(tree.points_ ? item : triangles(k, item)) - tree.origin_;
  };
  const auto box_of = [&](int item) {
    Vector3d low = corner(item, 0), high = low;
    for (int k = 1; k < corner_count; ++k) {
      const Vector3d at = corner(item, k);
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    FloatBox box;
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = FloatBox::RoundDown(low[k] * tree.box_scale_);
      box.hi[k] = FloatBox::RoundUp(high[k] * tree.box_scale_);
    }
    return box;
  };
  // Four items are asked in the time that a node of their own would take, in a third of its memory.
  constexpr int kRunBits = 2;
  tree.run_bits_ = count > std::numeric_limits<int>::max() >> kRunBits ? 0 : kRunBits;
  if (count % children_per_face != 0) children_per_face = 1;
  std::vector<Center> centers(count / children_per_face);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(centers.size()), kLightBlock / children_per_face, context,
                  [&](int64_t begin, int64_t end) {
                    for (int i = static_cast<int>(begin); i < end; ++i) {
                      // Of a face's children one of each quarter tells the middle well enough.
                      FloatBox box;
                      const int quarter = std::max(1, children_per_face / kWidth);
                      for (int item = i * children_per_face; item < (i + 1) * children_per_face;
                           item += quarter)
                        box.Add(box_of(item));
                      for (int k = 0; k < 3; ++k) centers[i].at[k] = 0.5f * (box.lo[k] + box.hi[k]);
                      centers[i].face = i;
                    }
                  }));
  RILIEVO_RETURN_IF_ERROR(tree.BuildNodes(box_of, children_per_face, context, centers));

  tree.items_.resize(count);
  for (int i = 0; i < count; ++i) {
    tree.items_[i] =
        centers[i / children_per_face].face * children_per_face + i % children_per_face;
  }
  return tree;
}

}  // namespace rilievo
