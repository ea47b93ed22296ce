#include "core/surface/measure_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/one_way_distances.h"
#include "core/surface/surface_samples.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Points at most this far from a part's box ask it first: of the diagonal.
constexpr double kNear = 0.01;

// Distances of points from the nearest of all parts.
class NearestOfParts {
 public:
  explicit NearestOfParts(const Eigen::Matrix3Xd& points)
      : points_(points), squared_(points.cols(), std::numeric_limits<double>::infinity()) {}

  // `reach`: points farther than that from the part's box need not ask it.
  absl::Status Ask(const Shape& part, double reach, const RunContext& context) {
    Eigen::AlignedBox3d box;
    for (const auto vertex : part.vertices.colwise()) box.extend(vertex);
    std::vector<int64_t> asking;
    for (int64_t i = 0; i < points_.cols(); ++i) {
      const double away = box.squaredExteriorDistance(points_.col(i));
      if (away <= reach * reach && away < squared_[i]) asking.push_back(i);
    }
    if (asking.empty()) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(
        const ClosestPointTree tree,
        ClosestPointTree::Build(part.vertices, part.triangles, context, part.children_per_face));
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<double> found,
        SquaredDistances(
            static_cast<int64_t>(asking.size()),
            [&](int64_t i) -> Vector3d { return points_.col(asking[i]); }, tree, context));
    for (size_t i = 0; i < found.size(); ++i) {
      squared_[asking[i]] = std::min(squared_[asking[i]], found[i]);
    }
    return absl::OkStatus();
  }

  // Whether a part whose box this is may be nearer than what has been asked with `reach`.
  bool MayBeNearer(const Eigen::AlignedBox3d& box, double reach) const {
    for (int64_t i = 0; i < points_.cols(); ++i) {
      if (squared_[i] <= reach * reach) continue;
      const double away = box.squaredExteriorDistance(points_.col(i));
      if (away > reach * reach && away < squared_[i]) return true;
    }
    return false;
  }

  std::vector<double> TakeSquared() { return std::move(squared_); }

 private:
  const Eigen::Matrix3Xd& points_;
  std::vector<double> squared_;
};

Eigen::AlignedBox3d BoxOfShape(const Shape& shape) {
  Eigen::AlignedBox3d box;
  for (const auto vertex : shape.vertices.colwise()) box.extend(vertex);
  return box;
}

// Calls visit(part) for each part in order, and asks of all points how far it is.
template <typename Visit>
absl::StatusOr<std::vector<double>> SquaredToParts(const Eigen::Matrix3Xd& points,
                                                   const SurfaceParts& surface,
                                                   const RunContext& context, const Visit& visit) {
  NearestOfParts nearest(points);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (int i = 0; i < surface.count; ++i) {
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles part, surface.triangles(i, context));
    boxes.push_back(BoxOfShape(part.shape));
    RILIEVO_RETURN_IF_ERROR(visit(part));
    RILIEVO_RETURN_IF_ERROR(nearest.Ask(part.shape, kNear, context));
    context.Report(Stage::kMeasure, static_cast<double>(i + 1) / surface.count);
  }
  for (int i = 0; i < surface.count; ++i) {
    if (!nearest.MayBeNearer(boxes[i], kNear)) continue;
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles part, surface.triangles(i, context));
    RILIEVO_RETURN_IF_ERROR(nearest.Ask(part.shape, std::numeric_limits<double>::max(), context));
  }
  return nearest.TakeSquared();
}

void AddCounts(const PartTriangles& part, PartsError* found) {
  found->folds += part.folds;
  for (size_t source = 0; source < part.source_counts.size(); ++source) {
    found->source_counts[source] += part.source_counts[source];
  }
}

double LargestOf(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

DistanceSummary SummaryOf(std::vector<double> squared, double largest_squared,
                          std::vector<double>* pooled) {
  DistanceSummary summary;
  summary.samples = static_cast<int64_t>(squared.size());
  if (squared.empty()) return summary;
  const auto count = static_cast<double>(squared.size());
  summary.max = std::sqrt(std::max(largest_squared, LargestOf(squared)));
  double sum = 0, sum_of_squares = 0;
  for (double& value : squared) {
    sum_of_squares += value;
    value = std::sqrt(value);
    sum += value;
  }
  summary.mean = sum / count;
  summary.rms = std::sqrt(sum_of_squares / count);
  if (pooled != nullptr) pooled->insert(pooled->end(), squared.begin(), squared.end());
  summary.p95 = Percentile95(squared);
  return summary;
}

// What the samples of the parts so far have shown.
class SamplesOfParts {
 public:
  SamplesOfParts(const SurfaceParts& surface, const SearchableShape& b, int samples,
                 const RunContext& context)
      : b_(b), context_(context), sampler_(surface.area / samples, context.seed) {}

  absl::Status Take(const Shape& part) {
    SurfaceSamples samples;
    samples.places = sampler_.Next(part.vertices, part.triangles, &samples.faces);
    std::vector<double> across;
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<double> squared,
        SquaredAcrossCloud(part, samples, b_.shape, b_.tree, context_, &across));
    for (size_t i = 0; i < squared.size(); ++i) {
      squared_.push_back(squared[i]);
      if (IsFilled(part, samples.faces[i])) continue;
      across_sum_ += across[i];
      across_count_ += 1;
    }
    const auto vertex = [&](int64_t i) -> Vector3d { return part.vertices.col(i); };
    RILIEVO_ASSIGN_OR_RETURN(
        largest_, LargestSquaredDistance(part.vertices.cols(), vertex, b_.tree,
                                         std::max(largest_, LargestOf(squared)), context_));
    return absl::OkStatus();
  }

  double AcrossRms() const { return std::sqrt(across_sum_ / std::max(across_count_, 1.0)); }
  DistanceSummary Summary(std::vector<double>* pooled) {
    return SummaryOf(std::move(squared_), largest_, pooled);
  }

 private:
  const SearchableShape& b_;
  const RunContext& context_;
  AreaSampler sampler_;
  std::vector<double> squared_;
  double largest_ = 0, across_sum_ = 0, across_count_ = 0;
};

}  // namespace

absl::StatusOr<PartsError> MeasureParts(const SurfaceParts& surface, const SearchableShape& b,
                                        const MeasureOptions& options, const RunContext& context) {
  if (!(surface.area > 0)) {
    return absl::InvalidArgumentError("the surface has no area, so no samples of it can be taken");
  }
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  PartsError found;
  SamplesOfParts samples(surface, b, options.samples, context);
  const auto visit = [&](const PartTriangles& part) {
    AddCounts(part, &found);
    return samples.Take(part.shape);
  };
  RILIEVO_ASSIGN_OR_RETURN(std::vector<double> back,
                           SquaredToParts(b.shape.vertices, surface, context, visit));
  TwoSidedError& error = found.error;
  std::vector<double> pooled;
  error.a_to_b = samples.Summary(&pooled);
  error.b_to_a = SummaryOf(std::move(back), 0, &pooled);
  const auto square = [](double x) { return x * x; };
  error.rms = std::sqrt((square(error.a_to_b.rms) + square(error.b_to_a.rms)) / 2);
  error.across_rms = std::max(samples.AcrossRms(), error.b_to_a.rms);
  error.mean = (error.a_to_b.mean + error.b_to_a.mean) / 2;
  error.max = std::max(error.a_to_b.max, error.b_to_a.max);
  error.p95 = Percentile95(pooled);
  return found;
}

absl::StatusOr<PartsError> CountParts(const SurfaceParts& surface, const RunContext& context) {
  PartsError found;
  for (int i = 0; i < surface.count; ++i) {
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles part, surface.triangles(i, context));
    AddCounts(part, &found);
  }
  return found;
}

absl::StatusOr<DistanceSummary> MeasureToParts(const Eigen::Matrix3Xd& points,
                                               const SurfaceParts& surface,
                                               const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      std::vector<double> squared,
      SquaredToParts(points, surface, context,
                     [](const PartTriangles& /*part*/) { return absl::OkStatus(); }));
  return SummaryOf(std::move(squared), 0, nullptr);
}

}  // namespace rilievo
