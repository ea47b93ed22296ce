// The k-nearest-neighbour graph, built once; and the index it came from, for other queries.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

// Exact nearest-neighbour index (FLANN KDTreeSingleIndex). Keeps its own copy of the points, 40
// bytes each with the tree over them; immutable after construction, so queries from many threads
// are safe.
class PointIndex {
 public:
  // `points`: column = point, finite, unit frame, at least one. Built on the context's threads;
  // CANCELLED within half a second, as FLANN itself cannot be stopped.
  // `curve`: its ScanFromUnit carries the points to where they were sorted along the Morton curve;
  // points in any other order, or another place, are answered as exactly, but not as fast.
  static absl::StatusOr<PointIndex> Build(const Eigen::Matrix3Xd& points, const RunContext& context,
                                          const SpatialFrame& curve = {});
  // The same, for few points: nothing stops it.
  explicit PointIndex(const Eigen::Matrix3Xd& points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  int size() const;

  // The `k` (<= size()) nearest points of one position, ascending by distance; fills
  // indices[0..k) and squared_distances[0..k). Returns how many were found.
  int Nearest(const Eigen::Vector3d& position, int k, int* indices,
              double* squared_distances) const;

  // The nearest point of each column of `positions`, on all threads.
  absl::StatusOr<std::vector<int>> NearestOfEach(const Eigen::Matrix3Xd& positions,
                                                 const RunContext& context) const;

 private:
  struct Impl;
  explicit PointIndex(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// A point and one of the sheet that faces its own across a wall or a gap.
struct FacingPair {
  int point, across;
};

struct NeighborGraph {
  int k = 0;                 // neighbours a point, the point itself not among them
  std::vector<int> indices;  // point i: [i * k, (i + 1) * k), ascending by distance
  // Ascending. None but from SeparateSheets: lists of these points hold the nearest of their sheet.
  std::vector<FacingPair> facing;

  int size() const { return k == 0 ? 0 : static_cast<int>(indices.size()) / k; }
  std::span<const int> neighbors(int point) const {
    return {indices.data() + static_cast<size_t>(point) * k, static_cast<size_t>(k)};
  }
  // The point of the sheet that faces its own; -1 where none is known.
  int across(int point) const;
};

// Distances of the listed neighbours, in the order of the list and in the frame of `points`.
std::vector<float> NeighborDistances(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                     int point);

inline constexpr int kMostNeighbors = 64;

// The `k` (<= kMostNeighbors, < points) nearest other points of one, ascending by distance, into
// neighbors[0..k). `index`: of `points`.
void ListNeighbors(const PointIndex& index, const Eigen::Matrix3Xd& points, int point, int k,
                   int* neighbors);

struct NeighborOptions {
  int k = 16;  // [6, kMostNeighbors]; lowered to size - 1 for small sets
  absl::Status Validate() const;
};

absl::StatusOr<NeighborGraph> BuildNeighborGraph(const PointIndex& index,
                                                 const Eigen::Matrix3Xd& points,
                                                 const NeighborOptions& options,
                                                 const RunContext& context);

}  // namespace rilievo
