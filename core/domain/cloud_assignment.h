// Cloud to domain: which sample each cloud point belongs to, so that the fit sees what it does not
// cover yet.
#pragma once

#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Unit vector halfway between two unit normals. The offset of two points of a surface along it,
// (n_a + n_b)/|n_a + n_b| . (b - a), vanishes on any sphere and is of third order in their distance
// on any surface, where the plane of either point alone errs by curvature/2 times the squared
// distance (the symmetric objective of Rusinkiewicz 2019).
Eigen::Vector3d HalfwayNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// The nearest sample with an agreeing normal, for every point of the cloud or of an even subset.
// The first update searches a tree; later ones walk from the last answer over the samples'
// mesh, about fifteen times cheaper.
class CloudAssignment {
 public:
  // Both must outlive this.
  CloudAssignment(const OrientedCloud& cloud, const DomainSamples& samples);

  absl::Status Update(const SampledSurface& surface, const RunContext& context);

  // Indices into the cloud, ascending, of the points that belong to a sample.
  std::span<const int> PointsOf(int sample) const {
    const auto s = static_cast<size_t>(sample);
    return {points_.data() + begin_[s], static_cast<size_t>(begin_[s + 1] - begin_[s])};
  }

  // Root mean square of the offsets of all points of the subset along the halfway normal; along
  // the sample's normal where the two disagree. Unit frame.
  double rms() const { return rms_; }

  int subset_size() const { return subset_size_; }

 private:
  absl::Status SearchTree(const SampledSurface& surface, const RunContext& context);
  int Walk(const SampledSurface& surface, int point, int start) const;
  int PointOf(size_t i) const { return static_cast<int>(i) * stride_; }
  void SortBySample();

  const OrientedCloud& cloud_;
  const DomainSamples& samples_;
  int stride_ = 1;  // every so many-th cloud point takes part
  int subset_size_ = 0;
  std::vector<int> nearest_;  // sample of each point that takes part
  std::vector<char> agrees_;
  std::vector<double> block_squares_;
  std::vector<int> begin_, points_;
  double rms_ = 0;
};

}  // namespace rilievo
