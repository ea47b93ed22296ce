// Foot points: for each sample of the domain, where the cloud says that the surface runs.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/cloud_assignment.h"
#include "core/domain/domain_samples.h"
#include "core/domain/sharp_foot_points.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

// One entry (column) a sample.
struct FootPoints {
  Eigen::Matrix3Xd normals;  // unit n_q, halfway between the cloud's normal there and the sample's
  std::vector<double> offset;  // n_q . (q - S), unit frame; 0 where there is no data
  std::vector<double> weight;  // of the robust loss, in (0, 1]; 0: no data
  // Sharp samples only, in the order of DomainSamples::sharp: the way to where the cloud's sides
  // meet, or to its sharp line where that is known, and the directions in which it is known;
  // `offset` is its part along `normals` there.
  Eigen::Matrix3Xd sharp_moves;
  std::vector<SideAxes> sharp_axes;
  // Boundary samples only, zero elsewhere: the outward tangent across the boundary, and the way
  // along it from the sample to the cloud's border, of either sign.
  Eigen::Matrix3Xd conormals;
  std::vector<double> border_offset;
  std::vector<double> border_weight;  // 1 where a border was found, else 0
};

// Finds foot points both ways and averages them, so that noise averages out: a sample takes the
// cloud points assigned to it, or its nearest ones where there are none.
class FootPointSearch {
 public:
  // All must outlive this. `robust_spacings`: FitOptions::robust_spacings.
  FootPointSearch(const OrientedCloud& cloud, const PointIndex& index, const DomainSamples& samples,
                  double robust_spacings);

  // `foot_points` may be reused from an earlier call.
  absl::Status Update(const SampledSurface& surface, const RunContext& context,
                      FootPoints* foot_points);

  const OrientedCloud& cloud() const { return cloud_; }
  const PointIndex& index() const { return index_; }
  // Of the last surface; see CloudAssignment.
  double cloud_rms() const { return assignment_.rms(); }

 private:
  void FindFoot(const SampledSurface& surface, int sample, FootPoints* foot_points);
  void FindSharp(const SampledSurface& surface, int sample, FootPoints* foot_points);
  std::optional<SharpFootPoint> FootOnSides(const SampledSurface& surface, int sample) const;
  std::optional<SharpFootPoint> FootOnLine(const SampledSurface& surface, int sample) const;
  void FindBorder(const SampledSurface& surface, int sample, FootPoints* foot_points) const;
  void WeighRobustly(FootPoints* foot_points) const;

  const OrientedCloud& cloud_;
  const PointIndex& index_;
  const DomainSamples& samples_;
  const double robust_spacings_;
  CloudAssignment assignment_;
  std::optional<ClosestPointTree> lines_;  // of the cloud's sharp lines, where it has some
  std::vector<double> spacing_;            // of the cloud at each sample's foot
};

}  // namespace rilievo
