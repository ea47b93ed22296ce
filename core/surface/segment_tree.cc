#include "core/surface/segment_tree.h"

#include <algorithm>
#include <array>

namespace rilievo {
namespace {

constexpr size_t kNearestLookedAt = 64;

SegmentPlace PlaceOnSegment(const Eigen::Matrix3Xd& ends, int segment,
                            const Eigen::Vector3d& position) {
  const Eigen::Vector3d from = ends.col(2 * segment), way = ends.col(2 * segment + 1) - from;
  const double part = std::clamp((position - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return {from + part * way, way.normalized()};
}

}  // namespace

absl::StatusOr<ClosestPointTree> TreeOfSegments(const Eigen::Matrix3Xd& ends,
                                                const RunContext& context) {
  Eigen::Matrix3Xi triangles(3, ends.cols() / 2);  // without area
  for (int i = 0; i < triangles.cols(); ++i) triangles.col(i) << 2 * i, 2 * i + 1, 2 * i + 1;
  return ClosestPointTree::Build(ends, triangles, context);
}

SegmentPlace NearestOnSegments(const ClosestPointTree& tree, const Eigen::Matrix3Xd& ends,
                               const Eigen::Vector3d& position) {
  return PlaceOnSegment(ends, tree.source()[tree.Closest(position).item], position);
}

SegmentPlace NearestAlong(const ClosestPointTree& tree, const Eigen::Matrix3Xd& ends,
                          const Eigen::Vector3d& position, const Eigen::Vector3d& direction) {
  std::array<ClosestPointTree::Hit, kNearestLookedAt> hits;
  const int count = tree.Nearest(position, hits);
  for (int i = 0; i < count; ++i) {
    const int segment = tree.source()[hits[static_cast<size_t>(i)].item];
    const SegmentPlace place = PlaceOnSegment(ends, segment, position);
    if (place.along.dot(direction) > 0) return place;
  }
  return NearestOnSegments(tree, ends, position);
}

}  // namespace rilievo
