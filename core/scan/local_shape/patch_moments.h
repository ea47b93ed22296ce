// Mean and covariance of the points around a point, and how patches merge into wider ones.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// First and second moments of a patch of surface around one point, unit frame. The mean is kept
// as an offset from that point, so that float holds it to 1e-7 of the patch, not of the scan.
struct PatchMoments {
  Eigen::Vector3f mean_offset = Eigen::Vector3f::Zero();
  Eigen::Matrix<float, 6, 1> covariance =
      Eigen::Matrix<float, 6, 1>::Zero();  // xx xy xz yy yz zz, population form
};

// The plane through a patch: total least squares.
struct PatchPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit; sign without meaning
  double thickness = 0;  // variance along the normal, smallest eigenvalue
  double spread = 0;     // mean variance along the two other axes
};
PatchPlane FitPlane(const PatchMoments& moments);

// Moments of a point together with its neighbours.
PatchMoments MomentsOf(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors);

// Those of each point.
absl::StatusOr<std::vector<PatchMoments>> ComputePatchMoments(const Eigen::Matrix3Xd& points,
                                                              const NeighborGraph& graph,
                                                              const RunContext& context);

// Adds up patches of equal weight, as seen from one point.
class PatchSum {
 public:
  // `offset`: from the point of the sum to the point of `patch`.
  void Add(const PatchMoments& patch, const Eigen::Vector3d& offset);
  // Precondition: at least one Add().
  PatchMoments Mean() const;

 private:
  int count_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 1> second_ = Eigen::Matrix<double, 6, 1>::Zero();
};

}  // namespace rilievo
