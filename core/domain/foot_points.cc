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
// So many; and again so many where all the first lie on the other sheet of a thin wall.
constexpr int kNearest = 8;
constexpr int kNearestOfThinWall = 32;
// A sample whose nearest points all lie farther aside than this stands over a hole.
constexpr double kGapSpacings = 3.0;
// The direction from a far sample to its foot is as uncertain as the normals are.
constexpr double kGapPerOffset = 0.5;
// The border is looked for within this many samples along the surface: two control edges.
constexpr double kBorderReach = 2.0;
// Median to standard deviation of a normal distribution.
constexpr double kSigmaPerMedian = 1.4826;
constexpr double kRobustSigmas = 3.0;

// A sample, and the means over the cloud points that vouch for its foot.
class FootSum {
 public:
  FootSum(const OrientedCloud& cloud, const Eigen::Vector3d& position,
          const Eigen::Vector3d& normal)
      : cloud_(cloud), position_(position), normal_(normal) {}

  // A point assigned to the sample.
  void AddAssigned(int point) { Add(point, Offset(point), 1.0); }

  // One of the sample's nearest points; counts only where it lies across from the sample rather
  // than aside. Returns false for a point of another sheet.
  bool AddNearest(int point) {
    if (cloud_.normals.col(point).dot(normal_) <= kNormalAgreement) return false;
    const double offset = Offset(point);
    const double squared_way = (cloud_.points.col(point) - position_).squaredNorm();
    const double squared_aside = std::max(0.0, squared_way - offset * offset);
    const double gap = kGapSpacings * cloud_.spacing[static_cast<size_t>(point)] +
                       kGapPerOffset * std::abs(offset);
    if (squared_aside < gap * gap) {
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
  Eigen::Vector3d cloud_normal_ = Eigen::Vector3d::Zero();
  double offset_ = 0, spacing_ = 0, weight_ = 0;
};

// Adds the nearest points of `position`; returns those it looked at.
std::vector<int> AddNearestPoints(const PointIndex& index, const Eigen::Vector3d& position,
                                  FootSum* sum) {
  std::vector<int> found;
  double squared[kNearestOfThinWall];
  for (int wanted : {kNearest, kNearestOfThinWall}) {
    found.resize(static_cast<size_t>(wanted));
    found.resize(static_cast<size_t>(index.Nearest(position, wanted, found.data(), squared)));
    bool same_sheet = false;
    for (int point : found) same_sheet |= sum->AddNearest(point);
    if (same_sheet) break;
  }
  return found;
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
  Resize(samples_.size(), foot_points);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(samples_.size(), kSamplesPerTask, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) FindFoot(surface, static_cast<int>(i), foot_points);
      }));
  WeighRobustly(foot_points);
  return absl::OkStatus();
}

void FootPointSearch::FindFoot(const SampledSurface& surface, int sample, FootPoints* feet) {
  const auto assigned = assignment_.PointsOf(sample);
  FootSum sum(cloud_, surface.positions.col(sample), surface.normals.col(sample));
  if (samples_.on_boundary(sample)) {
    // The points assigned to it may all lie beyond the boundary.
    std::vector<int> nearby = AddNearestPoints(index_, surface.positions.col(sample), &sum);
    nearby.insert(nearby.end(), assigned.begin(), assigned.end());
    FindBorder(surface, sample, nearby, feet);
  } else if (assigned.size() < kEnoughAssigned) {
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
