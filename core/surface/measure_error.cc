#include "core/surface/measure_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/one_way_distances.h"
#include "core/surface/surface_samples.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kMinSamples = 1000;
constexpr int kMaxSamples = 10'000'000;

absl::Status CheckShape(const Shape& shape, const char* name) {
  if (shape.vertices.cols() == 0) {
    return absl::InvalidArgumentError(absl::StrCat("shape ", name, " is empty"));
  }
  if (!shape.vertices.allFinite()) {
    return absl::InvalidArgumentError(
        absl::StrCat("shape ", name, " has a coordinate that is not finite"));
  }
  if (!shape.gaps.empty() &&
      static_cast<Eigen::Index>(shape.gaps.size()) != shape.vertices.cols()) {
    return absl::InvalidArgumentError(absl::StrCat("shape ", name, " has ", shape.gaps.size(),
                                                   " gaps for ", shape.vertices.cols(), " points"));
  }
  if (shape.normals.cols() != 0 && shape.normals.cols() != shape.vertices.cols()) {
    return absl::InvalidArgumentError(absl::StrCat("shape ", name, " has ", shape.normals.cols(),
                                                   " normals for ", shape.vertices.cols(),
                                                   " points"));
  }
  if (!shape.filled.empty() &&
      static_cast<Eigen::Index>(shape.filled.size()) != shape.vertices.cols()) {
    return absl::InvalidArgumentError(absl::StrCat("shape ", name, " has ", shape.filled.size(),
                                                   " marks of filled vertices for ",
                                                   shape.vertices.cols(), " vertices"));
  }
  if (shape.triangles.cols() == 0) return absl::OkStatus();
  if (shape.triangles.minCoeff() < 0 || shape.triangles.maxCoeff() >= shape.vertices.cols()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a triangle of shape ", name, " names a vertex outside 0 to ", shape.vertices.cols() - 1));
  }
  return absl::OkStatus();
}

absl::StatusOr<ClosestPointTree> TreeOf(const Shape& shape, const RunContext& context) {
  return ClosestPointTree::Over(shape.vertices, shape.triangles, context, shape.children_per_face);
}

// The vertices in the order in which the triangles of `order` first name them, so that neighbours
// in the list are neighbours in space.
std::vector<int> VerticesInOrder(const Shape& shape, const std::vector<int>& order) {
  std::vector<uint8_t> seen(shape.vertices.cols(), 0);
  std::vector<int> vertices;
  vertices.reserve(shape.vertices.cols());
  for (int face : order) {
    for (int k = 0; k < 3; ++k) {
      const int v = shape.triangles(k, face);
      if (seen[v] != 0) continue;
      seen[v] = 1;
      vertices.push_back(v);
    }
  }
  return vertices;
}

struct OneWay {
  DistanceSummary summary;
  std::vector<double> distances;
  double across_rms = -1;  // see TwoSidedError
};

double RmsWhereNotFilled(const Shape& shape, const SurfaceSamples& samples,
                         const std::vector<double>& squared) {
  double sum = 0, counted = 0;
  for (size_t i = 0; i < squared.size(); ++i) {
    if (IsFilled(shape, samples.faces[i])) continue;
    sum += squared[i];
    counted += 1;
  }
  return std::sqrt(sum / std::max(counted, 1.0));
}

// `order`: of the triangles of `from`, or of its points, such that neighbours in it are neighbours
// in space.
absl::StatusOr<OneWay> MeasureOneWay(const Shape& from, const std::vector<int>& order,
                                     const Shape& to, const ClosestPointTree& to_tree, int samples,
                                     const RunContext& context) {
  const auto vertex = [&](int64_t i) -> Vector3d { return from.vertices.col(i); };
  OneWay way;
  std::vector<double> squared;
  if (from.triangles.cols() == 0) {
    const auto point = [&](int64_t i) { return vertex(order[i]); };
    RILIEVO_ASSIGN_OR_RETURN(
        squared, SquaredDistances(static_cast<int64_t>(order.size()), point, to_tree, context));
  } else {
    SurfaceSamples taken;
    taken.places =
        SampleByArea(from.vertices, from.triangles, order, samples, context.seed, &taken.faces);
    if (!to.gaps.empty() && to.triangles.cols() == 0) {
      std::vector<double> across;
      RILIEVO_ASSIGN_OR_RETURN(squared,
                               SquaredAcrossCloud(from, taken, to, to_tree, context, &across));
      way.across_rms = RmsWhereNotFilled(from, taken, across);
    } else {
      const auto sample = [&](int64_t i) -> Vector3d { return taken.places.col(i); };
      RILIEVO_ASSIGN_OR_RETURN(squared,
                               SquaredDistances(taken.places.cols(), sample, to_tree, context));
      if (to.triangles.cols() > 0) way.across_rms = RmsWhereNotFilled(from, taken, squared);
    }
    const std::vector<int> vertices = VerticesInOrder(from, order);
    const auto corner = [&](int64_t i) { return vertex(vertices[i]); };
    RILIEVO_ASSIGN_OR_RETURN(
        const double largest,
        LargestSquaredDistance(static_cast<int64_t>(vertices.size()), corner, to_tree,
                               *std::max_element(squared.begin(), squared.end()), context));
    way.summary.max = std::sqrt(largest);
  }
  const double count = static_cast<double>(squared.size());
  double sum = 0, sum_of_squares = 0;
  for (double& value : squared) {
    sum_of_squares += value;
    value = std::sqrt(value);
    sum += value;
    way.summary.max = std::max(way.summary.max, value);
  }
  way.distances = std::move(squared);
  way.summary.samples = static_cast<int64_t>(way.distances.size());
  way.summary.mean = sum / count;
  way.summary.rms = std::sqrt(sum_of_squares / count);
  way.summary.p95 = Percentile95(way.distances);
  return way;
}

absl::StatusOr<TwoSidedError> MeasureBothWays(const Shape& a, const ClosestPointTree& tree_a,
                                              const Shape& b, const ClosestPointTree& tree_b,
                                              const MeasureOptions& options,
                                              const RunContext& context) {
  context.Report(Stage::kMeasure, 0.2);
  // Samples are taken, and figures made of distances, on one thread.
  OneWay a_to_b, b_to_a;
  const auto there = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        a_to_b, MeasureOneWay(a, tree_a.source(), b, tree_b, options.samples, context));
    return absl::OkStatus();
  };
  const auto back = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        b_to_a, MeasureOneWay(b, tree_b.source(), a, tree_a, options.samples, context));
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, there, back));
  TwoSidedError error;
  error.a_to_b = a_to_b.summary;
  error.b_to_a = b_to_a.summary;
  const auto square = [](double x) { return x * x; };
  error.rms = std::sqrt((square(error.a_to_b.rms) + square(error.b_to_a.rms)) / 2);
  if (a_to_b.across_rms >= 0) {
    error.across_rms = std::max(a_to_b.across_rms, error.b_to_a.rms);
  }
  error.mean = (error.a_to_b.mean + error.b_to_a.mean) / 2;
  error.max = std::max(error.a_to_b.max, error.b_to_a.max);
  std::vector<double>& pooled = a_to_b.distances;
  pooled.insert(pooled.end(), b_to_a.distances.begin(), b_to_a.distances.end());
  error.p95 = Percentile95(pooled);
  context.Report(Stage::kMeasure, 1);
  return error;
}

}  // namespace

absl::Status MeasureOptions::Validate() const {
  if (samples < kMinSamples || samples > kMaxSamples) {
    return absl::InvalidArgumentError(absl::StrCat("measure.samples is ", samples, ", must be ",
                                                   kMinSamples, " to ", kMaxSamples));
  }
  return absl::OkStatus();
}

absl::StatusOr<TwoSidedError> MeasureTwoSided(const Shape& a, const Shape& b,
                                              const MeasureOptions& options,
                                              const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckShape(a, "a"));
  RILIEVO_RETURN_IF_ERROR(CheckShape(b, "b"));
  context.Report(Stage::kMeasure, 0);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree_a, TreeOf(a, context));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree_b, TreeOf(b, context));
  return MeasureBothWays(a, tree_a, b, tree_b, options, context);
}

absl::StatusOr<SearchableShape> MakeSearchable(Shape shape, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckShape(shape, "b"));
  RILIEVO_ASSIGN_OR_RETURN(ClosestPointTree tree, TreeOf(shape, context));
  return SearchableShape{std::move(shape), std::move(tree)};
}

absl::StatusOr<TwoSidedError> MeasureAgainst(const Shape& a, const SearchableShape& b,
                                             const MeasureOptions& options,
                                             const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckShape(a, "a"));
  context.Report(Stage::kMeasure, 0);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree_a, TreeOf(a, context));
  return MeasureBothWays(a, tree_a, b.shape, b.tree, options, context);
}

absl::StatusOr<DistanceSummary> MeasureOneSided(const Shape& from, const Shape& to,
                                                const MeasureOptions& options,
                                                const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckShape(from, "from"));
  RILIEVO_RETURN_IF_ERROR(CheckShape(to, "to"));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree to_tree, TreeOf(to, context));
  std::vector<int> order(from.triangles.cols() > 0 ? from.triangles.cols() : from.vertices.cols());
  std::iota(order.begin(), order.end(), 0);
  RILIEVO_ASSIGN_OR_RETURN(const OneWay way,
                           MeasureOneWay(from, order, to, to_tree, options.samples, context));
  return way.summary;
}

}  // namespace rilievo
