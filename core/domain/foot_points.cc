#include "core/domain/foot_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/domain/sharp_foot_points.h"
#include "core/geometry/vertex_ring.h"
#include "core/points/settings.h"
#include "core/surface/segment_tree.h"

namespace rilievo {
namespace {

// A sample, and the means over the cloud points that vouch for its foot.
class FootSum {
 public:
  FootSum(const OrientedCloud& cloud, const Eigen::Vector3d& position,
          const Eigen::Vector3d& normal, double reach)
      : cloud_(cloud), position_(position), normal_(normal), reach_(reach) {}

  // A point assigned to the sample.
  void AddAssigned(int point) { Add(point, Offset(point), 1.0); }

  // One of the sample's nearest points; counts only where it lies across from the sample rather
  // than aside. Returns false for a point of another sheet.
  bool AddNearest(int point) {
    if (cloud_.normals.col(point).dot(normal_) <= kCommon.same_sheet) return false;
    const double offset = Offset(point);
    const double squared_way = (cloud_.points.col(point) - position_).squaredNorm();
    const double squared_aside = std::max(0.0, squared_way - offset * offset);
    // A sample whose nearest points all lie farther aside stands over a hole.
    const double gap = kCommon.gap_spacings * cloud_.spacing[static_cast<size_t>(point)] +
                       kFootPoints.gap_per_offset * std::abs(offset);
    if (squared_aside < gap * gap && squared_way < reach_ * reach_) {
      Add(point, offset, std::exp(-4.5 * squared_aside / (gap * gap)));
    }
    return true;
  }

  bool empty() const { return weight_ == 0; }
  Eigen::Vector3d normal() const { return HalfwayNormal(normal_, cloud_normal_.normalized()); }
  double offset() const { return offset_ / weight_; }
  double spacing() const { return spacing_ / weight_; }

 private:
  double Offset(int point) const {
    return HalfwayNormal(normal_, cloud_.normals.col(point))
        .dot(cloud_.points.col(point) - position_);
  }
  void Add(int point, double offset, double weight) {
    cloud_normal_ += weight * cloud_.normals.col(point);
    offset_ += weight * offset;
    spacing_ += weight * cloud_.spacing[static_cast<size_t>(point)];
    weight_ += weight;
  }

  const OrientedCloud& cloud_;
  const Eigen::Vector3d position_, normal_;
  const double reach_;
  Eigen::Vector3d cloud_normal_ = Eigen::Vector3d::Zero();
  double offset_ = 0, spacing_ = 0, weight_ = 0;
};

void AddNearestPoints(const PointIndex& index, const Eigen::Vector3d& position, FootSum* sum) {
  int found[kCommon.points_by_border];
  double squared[kCommon.points_by_border];
  for (int wanted : {kCommon.near_points, kCommon.points_by_border}) {
    const int count = index.Nearest(position, wanted, found, squared);
    bool same_sheet = false;
    for (int k = 0; k < count; ++k) same_sheet |= sum->AddNearest(found[k]);
    if (same_sheet) return;
  }
}

// Two control edges, as long as they are around the sample.
double Reach(const DomainSamples& samples, const SampledSurface& surface, int sample) {
  const std::span<const int> ring = RingOf(samples.rings, sample);
  double length = 0;
  for (const int other : ring) {
    length += (surface.positions.col(other) - surface.positions.col(sample)).norm();
  }
  length /= static_cast<double>(ring.size());
  return kFootPoints.reach_in_control_edges * length * (1 << samples.refinement.max_level());
}

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
  if (!lines_ && cloud_.sharp_lines.cols() > 0) {
    RILIEVO_ASSIGN_OR_RETURN(lines_, TreeOfSegments(cloud_.sharp_lines, context));
  }
  Resize(samples_.size(), foot_points);
  foot_points->sharp_axes.resize(samples_.sharp.size());
  foot_points->sharp_moves.setZero(3, static_cast<Eigen::Index>(samples_.sharp.size()));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(samples_.size(), kHeavyBlock, context, [&](int64_t i) {
    FindFoot(surface, static_cast<int>(i), foot_points);
  }));
  WeighRobustly(foot_points);
  return absl::OkStatus();
}

void FootPointSearch::FindFoot(const SampledSurface& surface, int sample, FootPoints* feet) {
  if (samples_.is_sharp(sample) && !samples_.on_boundary(sample)) {
    FindSharp(surface, sample, feet);
    return;
  }
  const auto assigned = assignment_.PointsOf(sample);
  FootSum sum(cloud_, surface.positions.col(sample), surface.normals.col(sample),
              Reach(samples_, surface, sample));
  const bool boundary = samples_.on_boundary(sample);
  if (boundary) FindBorder(surface, sample, feet);
  // The points assigned to a boundary sample may all lie beyond the boundary.
  if (boundary || assigned.empty()) {
    AddNearestPoints(index_, surface.positions.col(sample), &sum);
  } else {
    for (int point : assigned) sum.AddAssigned(point);
  }
  if (sum.empty()) return;
  const auto i = static_cast<size_t>(sample);
  feet->normals.col(sample) = sum.normal();
  feet->offset[i] = sum.offset();
  feet->weight[i] = 1;
  spacing_[i] = sum.spacing();
}

std::optional<SharpFootPoint> FootPointSearch::FootOnSides(const SampledSurface& surface,
                                                           int sample) const {
  int found[kCommon.points_by_border];
  double squared[kCommon.points_by_border];
  const int wanted = std::min(kCommon.points_by_border, index_.size());
  const int count = index_.Nearest(surface.positions.col(sample), wanted, found, squared);
  return FindSharpFootPoint(cloud_, {found, static_cast<size_t>(count)}, samples_, surface, sample);
}

// Corners have had their places from the beginning.
std::optional<SharpFootPoint> FootPointSearch::FootOnLine(const SampledSurface& surface,
                                                          int sample) const {
  SharpFootPoint foot{
      Eigen::Vector3d::Zero(),
      cloud_.median_spacing,
      {Eigen::Matrix3d::Identity(), kFootPoints.line_strength * Eigen::Vector3d::Ones()}};
  const bool is_corner = sample < samples_.control_vertex_count() &&
                         samples_.control_kinds[sample] == VertexKind::kCorner;
  if (is_corner) return foot;
  const Eigen::Vector3d position = surface.positions.col(sample);
  const auto [place, along] = NearestOnSegments(*lines_, cloud_.sharp_lines, position);
  foot.move = place - position;
  const Eigen::Vector3d across = along.unitOrthogonal();
  foot.sides.axes << across, along.cross(across), along;
  foot.sides.strength[2] = 0;
  return foot;
}

void FootPointSearch::FindSharp(const SampledSurface& surface, int sample, FootPoints* feet) {
  const auto foot = lines_ ? FootOnLine(surface, sample) : FootOnSides(surface, sample);
  const auto i = static_cast<size_t>(sample);
  const int slot = samples_.sharp_slot[i];
  feet->sharp_axes[slot] = foot ? foot->sides : AxesOfSides(samples_, surface, sample);
  if (!foot || foot->move.norm() > Reach(samples_, surface, sample)) return;
  feet->sharp_moves.col(slot) = foot->move;
  feet->normals.col(sample) = surface.normals.col(sample);
  feet->offset[i] = foot->move.dot(surface.normals.col(sample));
  feet->weight[i] = 1;
  spacing_[i] = foot->spacing;
}

// The cloud's border across from a boundary sample: the farthest point, along the conormal, without
// a gap before it, of those in a strip as wide as the sample's share of the boundary. The points
// assigned to the sample show a border that the surface falls short of, its nearest points one that
// it hangs over.
void FootPointSearch::FindBorder(const SampledSurface& surface, int sample,
                                 FootPoints* feet) const {
  const auto i = static_cast<size_t>(sample);
  const Eigen::Vector3d position = surface.positions.col(sample);
  const Eigen::Vector3d normal = surface.normals.col(sample);
  const Eigen::Vector3d chord = surface.positions.col(samples_.boundary_next[i]) -
                                surface.positions.col(samples_.boundary_previous[i]);
  const Eigen::Vector3d along = (chord - normal * normal.dot(chord)).normalized();
  const Eigen::Vector3d conormal = along.cross(normal);
  feet->conormals.col(sample) = conormal;
  const double step = chord.norm() / 2;
  const double reach = Reach(samples_, surface, sample);
  int found[kCommon.points_by_border];
  double squared[kCommon.points_by_border];
  const int count = index_.Nearest(position, kCommon.points_by_border, found, squared);
  const double spacing_here = cloud_.spacing[static_cast<size_t>(found[0])];
  // How far out the points lie that the boundary falls short of, and over which gap each is met.
  std::vector<std::pair<double, double>> beyond;
  const auto look_at = [&](int point) {
    if (cloud_.normals.col(point).dot(normal) <= kCommon.same_sheet) return;
    const Eigen::Vector3d way = cloud_.points.col(point) - position;
    const double spacing = cloud_.spacing[static_cast<size_t>(point)];
    if (std::abs(along.dot(way)) > std::max(step / 2, spacing)) return;
    if (way.squaredNorm() > reach * reach) return;
    const double border = conormal.dot(way);
    if (border > 0) {
      beyond.emplace_back(border, kFootPoints.border_gap * std::min(spacing, spacing_here));
      return;
    }
    if (feet->border_weight[i] == 0 || border > feet->border_offset[i]) {
      feet->border_offset[i] = border;
    }
    feet->border_weight[i] = 1;
  };
  for (int point : assignment_.PointsOf(sample)) look_at(point);
  for (int k = 0; k < count; ++k) look_at(found[k]);
  std::sort(beyond.begin(), beyond.end());
  for (const auto& [border, gap] : beyond) {
    if (border - std::max(0.0, feet->border_offset[i]) > gap) break;
    feet->border_offset[i] = border;
    feet->border_weight[i] = 1;
  }
}

// Huber's weights min(1, s/|h|), Huber 1964, the scale s being `robust_spacings` local spacings.
void FootPointSearch::WeighRobustly(FootPoints* feet) const {
  for (size_t i = 0; i < feet->offset.size(); ++i) {
    const double scale = robust_spacings_ * spacing_[i], offset = std::abs(feet->offset[i]);
    if (feet->weight[i] > 0 && offset > scale) feet->weight[i] = scale / offset;
  }
}

}  // namespace rilievo
