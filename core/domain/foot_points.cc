#include "core/domain/foot_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kSamplesPerTask = 512;
// With fewer assigned points than this, a sample asks for its nearest ones too.
constexpr size_t kEnoughAssigned = 3;
constexpr int kNearest = 8;
// Thin walls: how far down the list of nearest points one with an agreeing normal may be.
constexpr int kNearestAgreeing = 32;
// A sample whose nearest points all lie farther aside than this stands over a hole.
constexpr double kGapSpacings = 3.0;
// The direction from a far sample to its foot is as uncertain as the normals are.
constexpr double kGapPerOffset = 0.5;
// The border is looked for within this many samples along the surface: two control edges.
constexpr double kBorderReach = 2.0;
// Median to standard deviation of a normal distribution.
constexpr double kSigmaPerMedian = 1.4826;
constexpr double kRobustSigmas = 3.0;

// Means over the points that vouch for one foot.
struct FootSum {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0, spacing = 0, weight = 0;

  void Add(double w, const Eigen::Vector3d& n, double h, double s) {
    normal += w * n;
    offset += w * h;
    spacing += w * s;
    weight += w;
  }
};

void Resize(int count, FootPoints* feet) {
  const auto size = static_cast<size_t>(count);
  feet->normals.setZero(3, count);
  feet->offset.assign(size, 0.0);
  feet->weight.assign(size, 0.0);
  feet->conormals.setZero(3, count);
  feet->border_offset.assign(size, 0.0);
  feet->border_weight.assign(size, 0.0);
}

}  // namespace

FootPointSearch::FootPointSearch(const OrientedCloud& cloud, const PointIndex& index,
                                 const DomainSamples& samples, double robust_spacings)
    : cloud_(cloud),
      index_(index),
      samples_(samples),
      robust_spacings_(robust_spacings),
      assignment_(cloud, samples),
      spacing_(static_cast<size_t>(samples.size()), 0.0) {}

absl::Status FootPointSearch::Update(const SampledSurface& surface, const RunContext& context,
                                     FootPoints* foot_points) {
  RILIEVO_RETURN_IF_ERROR(assignment_.Update(surface, context));
  Resize(samples_.size(), foot_points);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(samples_.size(), kSamplesPerTask, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) FindFoot(surface, static_cast<int>(i), foot_points);
      }));
  WeighRobustly(foot_points);
  return absl::OkStatus();
}

void FootPointSearch::FindFoot(const SampledSurface& surface, int sample, FootPoints* feet) {
  const Eigen::Vector3d position = surface.positions.col(sample);
  const Eigen::Vector3d normal = surface.normals.col(sample);
  const auto assigned = assignment_.PointsOf(sample);
  const bool boundary = samples_.on_boundary(sample);
  FootSum sum;
  // Returns false for a point of another sheet.
  const auto add = [&](int point, bool nearby_only) {
    const Eigen::Vector3d cloud_normal = cloud_.normals.col(point);
    if (cloud_normal.dot(normal) <= kNormalAgreement) return false;
    const Eigen::Vector3d way = cloud_.points.col(point) - position;
    const double offset = HalfwayNormal(normal, cloud_normal).dot(way);
    const double spacing = cloud_.spacing[static_cast<size_t>(point)];
    double weight = 1;
    if (nearby_only) {
      const double aside2 = std::max(0.0, way.squaredNorm() - offset * offset);
      const double gap = kGapSpacings * spacing + kGapPerOffset * std::abs(offset);
      if (aside2 > gap * gap) return true;
      weight = std::exp(-0.5 * aside2 / (spacing * spacing));
    }
    sum.Add(weight, cloud_normal, offset, spacing);
    return true;
  };

  std::vector<int> nearby(assigned.begin(), assigned.end());
  if (assigned.size() >= kEnoughAssigned && !boundary) {
    for (int point : assigned) add(point, false);
  } else {
    int found[kNearestAgreeing];
    double squared[kNearestAgreeing];
    int agreeing = 0;
    for (int wanted : {kNearest, kNearestAgreeing}) {
      const int count = index_.Nearest(position, wanted, found, squared);
      for (int k = 0; k < count; ++k) agreeing += add(found[k], true) ? 1 : 0;
      nearby.insert(nearby.end(), found, found + count);
      if (agreeing > 0) break;
    }
  }
  if (boundary) FindBorder(surface, sample, nearby, feet);
  if (!(sum.weight > 0)) return;
  const auto i = static_cast<size_t>(sample);
  feet->normals.col(sample) = HalfwayNormal(normal, sum.normal.normalized());
  feet->offset[i] = sum.offset / sum.weight;
  feet->weight[i] = 1;
  spacing_[i] = sum.spacing / sum.weight;
}

// The cloud's border across from a boundary sample: the farthest point, along the conormal, of
// those in a strip as wide as the sample's share of the boundary.
void FootPointSearch::FindBorder(const SampledSurface& surface, int sample,
                                 const std::vector<int>& nearby, FootPoints* feet) const {
  const auto i = static_cast<size_t>(sample);
  const Eigen::Vector3d position = surface.positions.col(sample);
  const Eigen::Vector3d normal = surface.normals.col(sample);
  const Eigen::Vector3d chord = surface.positions.col(samples_.boundary_next[i]) -
                                surface.positions.col(samples_.boundary_previous[i]);
  const Eigen::Vector3d along = (chord - normal * normal.dot(chord)).normalized();
  const Eigen::Vector3d conormal = along.cross(normal);
  feet->conormals.col(sample) = conormal;
  const double step = chord.norm() / 2;
  const double reach = kBorderReach * step * (1 << samples_.refinement.max_level());
  double border = -reach;
  bool found = false;
  for (int point : nearby) {
    if (cloud_.normals.col(point).dot(normal) <= kNormalAgreement) continue;
    const Eigen::Vector3d way = cloud_.points.col(point) - position;
    const double spacing = cloud_.spacing[static_cast<size_t>(point)];
    if (std::abs(along.dot(way)) > std::max(step / 2, spacing)) continue;
    if (way.squaredNorm() > reach * reach) continue;
    border = std::max(border, conormal.dot(way));
    found = true;
  }
  if (!found) return;
  feet->border_offset[i] = border;
  feet->border_weight[i] = 1;
}

// Huber's weights min(1, s/|h|), Huber 1964. The scale s is `robust_spacings` local spacings, or
// three deviations while the whole surface is still farther off than that.
void FootPointSearch::WeighRobustly(FootPoints* feet) {
  sorted_.clear();
  for (size_t i = 0; i < feet->offset.size(); ++i) {
    if (feet->weight[i] > 0) sorted_.push_back(std::abs(feet->offset[i]));
  }
  if (sorted_.empty()) return;
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double typical = kRobustSigmas * kSigmaPerMedian * *middle;
  for (size_t i = 0; i < feet->offset.size(); ++i) {
    if (feet->weight[i] == 0) continue;
    const double scale = std::max(robust_spacings_ * spacing_[i], typical);
    const double offset = std::abs(feet->offset[i]);
    if (offset > scale) feet->weight[i] = scale / offset;
  }
}

}  // namespace rilievo
