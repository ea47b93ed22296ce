#include "core/domain/cloud_assignment.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/geometry/vertex_ring.h"
#include "core/points/neighbor_graph.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

bool Agree(const OrientedCloud& cloud, const SampledSurface& surface, int point, int sample) {
  return cloud.normals.col(point).dot(surface.normals.col(sample)) > kCommon.same_sheet;
}

double SquaredDistance(const OrientedCloud& cloud, const SampledSurface& surface, int point,
                       int sample) {
  return (cloud.points.col(point) - surface.positions.col(sample)).squaredNorm();
}

// The normal of the surface at a sample as a point sees it: on a crease, of the side that it lies
// on.
Eigen::Vector3d NormalSeenBy(const OrientedCloud& cloud, const DomainSamples& samples,
                             const SampledSurface& surface, int point, int sample) {
  if (!samples.is_sharp(sample)) return surface.normals.col(sample);
  const auto slot = static_cast<size_t>(samples.sharp_slot[static_cast<size_t>(sample)]);
  int best = samples.side_begin[slot];
  double agreement = -2;
  for (int side = best; side < samples.side_begin[slot + 1]; ++side) {
    const double cosine = cloud.normals.col(point).dot(surface.side_normals.col(side));
    if (cosine > agreement) {
      agreement = cosine;
      best = side;
    }
  }
  return surface.side_normals.col(best);
}

double Offset(const OrientedCloud& cloud, const DomainSamples& samples,
              const SampledSurface& surface, int point, int sample, bool agree) {
  const Eigen::Vector3d normal = NormalSeenBy(cloud, samples, surface, point, sample);
  const Eigen::Vector3d direction =
      agree ? HalfwayNormal(normal, cloud.normals.col(point)) : normal;
  return direction.dot(cloud.points.col(point) - surface.positions.col(sample));
}

}  // namespace

Eigen::Vector3d HalfwayNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a + b).normalized();
}

CloudAssignment::CloudAssignment(const OrientedCloud& cloud, const DomainSamples& samples)
    : cloud_(cloud), samples_(samples) {
  const int64_t count = cloud.points.cols();
  const int64_t wanted =
      std::max(kCloudAssignment.small_cloud, kCloudAssignment.points_per_sample * samples.size());
  // The cloud is in Morton order, so every stride-th point is a spatially even choice.
  stride_ = static_cast<int>((count + wanted - 1) / wanted);
  subset_size_ = static_cast<int>((count + stride_ - 1) / stride_);
}

absl::Status CloudAssignment::Update(const SampledSurface& surface, const RunContext& context) {
  if (nearest_.empty()) RILIEVO_RETURN_IF_ERROR(SearchTree(surface, context));
  const int64_t count = subset_size_;
  agrees_.resize(nearest_.size());
  block_squares_.assign(static_cast<size_t>(count / kLightBlock + 1), 0.0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kLightBlock, context, [&](int64_t begin, int64_t end) {
    double squares = 0;
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const int point = PointOf(i);
      nearest_[i] = Walk(surface, point, nearest_[i]);
      const bool agree = Agree(cloud_, surface, point, nearest_[i]);
      agrees_[i] = agree;
      const double offset = Offset(cloud_, samples_, surface, point, nearest_[i], agree);
      squares += offset * offset;
    }
    block_squares_[static_cast<size_t>(begin / kLightBlock)] = squares;
  }));
  double squares = 0;
  for (double block : block_squares_) squares += block;
  rms_ = std::sqrt(squares / static_cast<double>(count));
  SortBySample();
  return absl::OkStatus();
}

absl::Status CloudAssignment::SearchTree(const SampledSurface& surface, const RunContext& context) {
  const PointIndex tree(surface.positions);
  nearest_.resize(static_cast<size_t>(subset_size_));
  return ParallelFor(subset_size_, kLightBlock, context, [&](int64_t begin, int64_t end) {
    int found[kCloudAssignment.candidates];
    double squared[kCloudAssignment.candidates];
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const int point = PointOf(i);
      tree.Nearest(cloud_.points.col(point), 1, found, squared);
      nearest_[i] = found[0];
      if (Agree(cloud_, surface, point, found[0])) continue;
      const int count =
          tree.Nearest(cloud_.points.col(point), kCloudAssignment.candidates, found, squared);
      const int* agreeing = std::find_if(
          found, found + count, [&](int sample) { return Agree(cloud_, surface, point, sample); });
      if (agreeing != found + count) nearest_[i] = *agreeing;
    }
  });
}

// Steps to a nearer sample while there is one. A point that sits on an agreeing sample never leaves
// for one that disagrees: so it cannot slip over the rim of a thin wall to the other sheet.
int CloudAssignment::Walk(const SampledSurface& surface, int point, int start) const {
  int at = start;
  bool agrees = Agree(cloud_, surface, point, at);
  double nearest = SquaredDistance(cloud_, surface, point, at);
  for (bool moved = true; moved;) {
    moved = false;
    for (const int candidate : RingOf(samples_.rings, at)) {
      const double distance = SquaredDistance(cloud_, surface, point, candidate);
      const bool nearer = distance < nearest;
      if (agrees && !nearer) continue;
      const bool candidate_agrees = Agree(cloud_, surface, point, candidate);
      if (agrees ? !candidate_agrees : !candidate_agrees && !nearer) continue;
      at = candidate;
      agrees = candidate_agrees;
      nearest = distance;
      moved = true;
    }
  }
  return at;
}

// A counting sort, so that the order within a sample is that of the cloud.
void CloudAssignment::SortBySample() {
  begin_.assign(static_cast<size_t>(samples_.size()) + 1, 0);
  for (size_t i = 0; i < nearest_.size(); ++i) {
    if (agrees_[i]) ++begin_[static_cast<size_t>(nearest_[i]) + 1];
  }
  for (size_t s = 1; s < begin_.size(); ++s) begin_[s] += begin_[s - 1];
  points_.resize(static_cast<size_t>(begin_.back()));
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (size_t i = 0; i < nearest_.size(); ++i) {
    if (agrees_[i]) {
      points_[static_cast<size_t>(next[static_cast<size_t>(nearest_[i])]++)] = PointOf(i);
    }
  }
}

}  // namespace rilievo
