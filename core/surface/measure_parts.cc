#include "core/surface/measure_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/surface/nearest_in_pages.h"
#include "core/surface/nearest_of_parts.h"
#include "core/surface/one_way_distances.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// `Part`: anything with folds and sources.
template <typename Part>
void AddCounts(const Part& part, PartsError* found) {
  found->folds += part.folds;
  for (size_t source = 0; source < part.source_counts.size(); ++source) {
    found->source_counts[source] += part.source_counts[source];
  }
}

double LargestOf(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

DistanceSummary SummaryOf(std::vector<double> squared, double largest_squared,
                          std::vector<double>* distances) {
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
  if (distances != nullptr) *distances = squared;
  summary.p95 = Percentile95(squared);
  return summary;
}

// Brings the distances of points to the pages they are of.
absl::Status Lower(const GatheredPoints& gathered, const std::vector<double>& squared,
                   PointPages* points) {
  for (const GatheredPoints::OfPage& page : gathered.pages) {
    RILIEVO_ASSIGN_OR_RETURN(std::vector<float> distances, points->Distances(page.page));
    for (int64_t i = page.begin; i < page.end; ++i) {
      float& known = distances[gathered.places[i]];
      known = std::min(known, static_cast<float>(squared[i]));
    }
    RILIEVO_RETURN_IF_ERROR(points->WriteDistances(page.page, distances));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<double>> KnownDistances(const GatheredPoints& gathered,
                                                   const PointPages& points) {
  std::vector<double> squared;
  for (const GatheredPoints::OfPage& page : gathered.pages) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> distances, points.Distances(page.page));
    for (int64_t i = page.begin; i < page.end; ++i) {
      squared.push_back(distances[gathered.places[i]]);
    }
  }
  return squared;
}

// What is farther than kNearPart from all parts that have been asked asks the others, so many
// points at a time.
absl::Status SettleFarPoints(const SurfaceParts& surface,
                             const std::vector<Eigen::AlignedBox3d>& boxes,
                             const RunContext& context, PointPages* points) {
  constexpr int64_t kAtATime = int64_t{1} << 18;
  std::vector<Vector3d> far;
  GatheredPoints gathered;
  const auto settle = [&]() -> absl::Status {
    gathered.shape.vertices = Eigen::Map<const Eigen::Matrix3Xd>(
        far.front().data(), 3, static_cast<Eigen::Index>(far.size()));
    RILIEVO_ASSIGN_OR_RETURN(std::vector<double> known, KnownDistances(gathered, *points));
    NearestOfParts nearest(gathered.shape.vertices, std::move(known));
    RILIEVO_RETURN_IF_ERROR(nearest.AskFarParts(surface, boxes, context));
    RILIEVO_RETURN_IF_ERROR(Lower(gathered, nearest.squared(), points));
    far.clear();
    gathered = GatheredPoints();
    return absl::OkStatus();
  };
  for (int page = 0; page < points->count(); ++page) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> distances, points->Distances(page));
    const auto is_far = [](float squared) { return squared > kNearPart * kNearPart; };
    if (std::none_of(distances.begin(), distances.end(), is_far)) continue;
    RILIEVO_ASSIGN_OR_RETURN(const Shape of_page, points->Read(page));
    const auto begin = static_cast<int64_t>(far.size());
    for (int i = 0; i < static_cast<int>(distances.size()); ++i) {
      if (!is_far(distances[i])) continue;
      far.emplace_back(of_page.vertices.col(i));
      gathered.places.push_back(i);
    }
    gathered.pages.push_back(
        {page, begin, static_cast<int64_t>(far.size()), static_cast<int>(distances.size())});
    if (static_cast<int64_t>(far.size()) >= kAtATime) RILIEVO_RETURN_IF_ERROR(settle());
  }
  return far.empty() ? absl::OkStatus() : settle();
}

// How many distances there are of each size, for a percentile of as many as there may be.
class DistanceCounts {
 public:
  void Add(double distance) {
    ++counts_[std::bit_cast<uint32_t>(static_cast<float>(distance)) >> kLeftOut];
    ++count_;
  }
  // As of one_way_distances.h, to 6e-5 of itself.
  double Percentile95() const {
    auto before = static_cast<int64_t>(0.95 * static_cast<double>(count_ - 1));
    for (uint32_t i = 0; i < counts_.size(); ++i) {
      before -= counts_[i];
      if (before < 0) return std::bit_cast<float>(i << kLeftOut | uint32_t{1} << (kLeftOut - 1));
    }
    return 0;
  }

 private:
  static constexpr int kLeftOut = 10;  // of 23 bits of the mantissa
  std::vector<int64_t> counts_ = std::vector<int64_t>(size_t{1} << (31 - kLeftOut));
  int64_t count_ = 0;
};

// `counts` takes the distances.
absl::StatusOr<DistanceSummary> SummaryOfPages(const PointPages& points, DistanceCounts* counts) {
  DistanceSummary summary;
  double sum = 0, sum_of_squares = 0, largest = 0;
  for (int page = 0; page < points.count(); ++page) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> distances, points.Distances(page));
    for (const double squared : distances) {
      const double distance = std::sqrt(squared);
      sum += distance;
      sum_of_squares += squared;
      largest = std::max(largest, squared);
      counts->Add(distance);
    }
    summary.samples += static_cast<int64_t>(distances.size());
  }
  if (summary.samples == 0) return summary;
  const auto count = static_cast<double>(summary.samples);
  summary.max = std::sqrt(largest);
  summary.mean = sum / count;
  summary.rms = std::sqrt(sum_of_squares / count);
  summary.p95 = counts->Percentile95();
  return summary;
}

}  // namespace

absl::StatusOr<PartsError> SumOfParts(const SurfaceParts& surface,
                                      const std::vector<MeasuredPart>& parts,
                                      const RunContext& context, PointPages* points) {
  PartsError found;
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<double> squared;
  double largest = 0, across_sum = 0;
  int64_t across_count = 0;
  for (const MeasuredPart& part : parts) {
    AddCounts(part, &found);
    boxes.emplace_back(Eigen::Vector3d(part.box.col(0)), Eigen::Vector3d(part.box.col(1)));
    squared.insert(squared.end(), part.squared.begin(), part.squared.end());
    largest = std::max(largest, part.largest);
    across_sum += part.across_sum;
    across_count += part.across_count;
  }
  RILIEVO_RETURN_IF_ERROR(SettleFarPoints(surface, boxes, context, points));
  TwoSidedError& error = found.error;
  DistanceCounts counts;
  RILIEVO_ASSIGN_OR_RETURN(error.b_to_a, SummaryOfPages(*points, &counts));
  std::vector<double> distances;
  error.a_to_b = SummaryOf(std::move(squared), largest, &distances);
  for (const double distance : distances) counts.Add(distance);
  const auto square = [](double x) { return x * x; };
  const double across =
      std::sqrt(across_sum / static_cast<double>(std::max<int64_t>(across_count, 1)));
  error.rms = std::sqrt((square(error.a_to_b.rms) + square(error.b_to_a.rms)) / 2);
  error.across_rms = std::max(across, error.b_to_a.rms);
  error.mean = (error.a_to_b.mean + error.b_to_a.mean) / 2;
  error.max = std::max(error.a_to_b.max, error.b_to_a.max);
  error.p95 = counts.Percentile95();
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
  const std::vector<double> unknown(points.cols(), std::numeric_limits<double>::infinity());
  NearestOfParts nearest(points, unknown);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (int i = 0; i < surface.count; ++i) {
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles part, surface.triangles(i, context));
    boxes.push_back(BoxOfShape(part.shape));
    RILIEVO_RETURN_IF_ERROR(nearest.Ask(part.shape, kNearPart, context));
    context.Report(Stage::kMeasure, static_cast<double>(i + 1) / surface.count);
  }
  RILIEVO_RETURN_IF_ERROR(nearest.AskFarParts(surface, boxes, context));
  return SummaryOf(nearest.TakeSquared(), 0, nullptr);
}

}  // namespace rilievo
