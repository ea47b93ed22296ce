// The nearest points of a place, exactly.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

// Exact nearest-neighbour index (FLANN KDTreeSingleIndex); immutable after construction, so queries
// from many threads are safe. 40 bytes a point with a copy of the points in the order of the tree,
// 24 bytes over points that stay where they are.
class PointIndex {
 public:
  // `points`: column = point, finite, unit frame, at least one. Built on the context's threads;
  // CANCELLED within half a second, as FLANN itself cannot be stopped.
  // `curve`: its ScanFromUnit carries the points to where they were sorted along the Morton curve;
  // points in any other order, or another place, are answered as exactly, but not as fast.
  static absl::StatusOr<PointIndex> Build(const Eigen::Matrix3Xd& points, const RunContext& context,
                                          const SpatialFrame& curve = {});
  // The same without a copy: the points must stay where they are, and as they are, for as long as
  // the index is asked. A little slower to ask.
  static absl::StatusOr<PointIndex> BuildOver(const Eigen::Matrix3Xd& points,
                                              const RunContext& context,
                                              const SpatialFrame& curve = {});
  // The same, for few points: nothing stops it.
  explicit PointIndex(const Eigen::Matrix3Xd& points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  int size() const;

  // The `k` (<= size()) nearest points of one position, ascending by distance; fills
  // indices[0..k) and squared_distances[0..k). Returns how many were found, of those within a
  // squared distance of `most_squared`: where all points lie farther off, it saves a wide search.
  int Nearest(const Eigen::Vector3d& position, int k, int* indices, double* squared_distances,
              double most_squared = std::numeric_limits<double>::max()) const;

  // All points nearer to a position than `radius`, in an order of their own. False when they are
  // more than `most`; `points` are some of them then.
  bool Within(const Eigen::Vector3d& position, double radius, int most,
              std::vector<int>* points) const;

  // The nearest point of each column of `positions`, on all threads.
  absl::StatusOr<std::vector<int>> NearestOfEach(const Eigen::Matrix3Xd& positions,
                                                 const RunContext& context) const;

 private:
  struct Impl;
  explicit PointIndex(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace rilievo
