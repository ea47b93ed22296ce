// Exact closest-point distances to triangles or points through a tree of boxes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/four_boxes.h"

namespace rilievo {

// A tree with four children a node, split at medians of the items' box centres. Boxes are float and
// rounded outward; the items themselves are double, and taken relative to the centre of them all.
// So a distance is that of a search of all items, in double, wherever the shape lies.
class ClosestPointTree {
 public:
  // `triangles` empty: the items are the points themselves. Indices must be in range, coordinates
  // finite, and there must be at least one item. CANCELLED is the only error.
  // `children_per_face`: a power of four; so many triangles in a row come of one by repeated
  // quartering, as those of a subdivision surface do. The tree takes their order over where it
  // would sort them.
  static absl::StatusOr<ClosestPointTree> Build(Eigen::Matrix3Xd vertices,
                                                Eigen::Matrix3Xi triangles,
                                                const RunContext& context,
                                                int children_per_face = 1);
  // The same, and the coordinates and indices stay the caller's: they must outlive the tree. (The
  // matrices may be moved, for what they hold stays where it is.)
  static absl::StatusOr<ClosestPointTree> Over(const Eigen::Matrix3Xd& vertices,
                                               const Eigen::Matrix3Xi& triangles,
                                               const RunContext& context,
                                               int children_per_face = 1);
  ClosestPointTree() = default;
  ClosestPointTree(ClosestPointTree&&) = default;
  ClosestPointTree& operator=(ClosestPointTree&&) = default;

  // The item nearest to `point`; `hint` (an item index, e.g. the result for a point close by)
  // makes the search shorter and never changes the distance. -1: no hint.
  struct Hit {
    double squared_distance;
    int item;
  };
  Hit Closest(const Eigen::Vector3d& point, int hint = -1) const;

  // Whether an item lies within `distance` of `point`: cheaper to tell than which is nearest.
  bool HasWithin(const Eigen::Vector3d& point, double distance) const;

  // The items nearest to `point`, nearest first, as many as `hits` has room for; returns how many,
  // fewer where there are no more, and none for a point 10^19 times farther off than the items lie.
  // `hinted`: `hits` is full of what was found for a point close by, which makes the search
  // shorter.
  int Nearest(const Eigen::Vector3d& point, std::span<Hit> hits, bool hinted = false) const;

  // Where a ray meets triangles.
  struct RayHit {
    double at;                // in lengths of the direction, >= 0
    int triangle;             // of the input
    bool from_behind;         // the triangle faces the way the ray goes
    Eigen::Vector3d weights;  // of its corners
  };
  // All hits, nearest first. Two triangles that share an edge never let a ray through between them;
  // one that meets both in it is told once. None for points and for a direction of no length.
  std::vector<RayHit> AlongRay(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;

  // Squared distance from `point` to item `item` alone.
  double SquaredDistanceTo(int item, const Eigen::Vector3d& point) const {
    return SquaredDistanceToItem(point - origin_, item);
  }

  int item_count() const { return static_cast<int>(items_.size()); }
  // Items are numbered so that neighbours in number are neighbours in space: item i is triangle
  // (or point) source()[i] of the input.
  const std::vector<int>& source() const { return items_; }

 private:
  static constexpr int kWidth = FourBoxes::kBoxes;  // children of a node
  // child >= 0: a node; < 0: a run of items, see RunOf(). The box of an unused slot is empty.
  struct Node {
    FourBoxes boxes;
    int32_t child[kWidth];
  };
  // The middle of the box of a face, whose children are items.
  struct Center {
    float at[3];
    int face;
  };
  template <typename BoxOfItem>
  class Builder;

  template <typename BoxOfItem>
  absl::Status BuildNodes(const BoxOfItem& box_of, int children_per_face, const RunContext& context,
                          std::vector<Center>& centers);

  // Items that follow each other and share a box.
  struct Run {
    int first, count;
  };
  Run RunOf(int32_t child) const {
    return {~child >> run_bits_, (~child & ((1 << run_bits_) - 1)) + 1};
  }
  int32_t ChildOf(Run run) const { return ~((run.first << run_bits_) | (run.count - 1)); }
  int most_in_run() const { return 1 << run_bits_; }

  // Lets `best` take items; those beyond its radius, which shrinks as it takes some, are passed by.
  template <typename Best>
  void Search(const Eigen::Vector3d& local, Best* best) const;
  double SquaredDistanceToItem(const Eigen::Vector3d& local, int item) const;
  // From the origin: of an item that is a triangle its k-th corner.
  Eigen::Vector3d CornerOf(int item, int k) const {
    const int64_t given = items_[item];
    const int64_t vertex = points_ ? given : triangles_[3 * given + k];
    return Eigen::Map<const Eigen::Vector3d>(vertices_ + 3 * vertex) - origin_;
  }

  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the corners
  double box_scale_ = 1;                              // box = box_scale_ * corner: within [-1, 1]
  bool points_ = false;
  int run_bits_ = 0;
  std::vector<int> items_;
  Eigen::Matrix3Xd own_vertices_;  // of Build()
  Eigen::Matrix3Xi own_triangles_;
  const double* vertices_ = nullptr;  // three coordinates each
  const int* triangles_ = nullptr;  // three vertices each, as given; unused where items are points
  std::vector<Node> nodes_;         // node 0 is the root
};

}  // namespace rilievo
