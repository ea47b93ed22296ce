#include "core/scan/clean/remove_outliers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/scan/clean/settings.h"
#include "core/scan/local_shape/patch_moments.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// How far the neighbours of each point are.
struct Reaches {
  int k = 0;
  std::vector<float> distances;  // in the layout of the graph
  std::vector<float> mean;
  std::vector<float> middle;  // of the neighbour in the middle of the list

  std::span<const float> of(int point) const {
    return {distances.data() + static_cast<size_t>(point) * k, static_cast<size_t>(k)};
  }
};

absl::StatusOr<Reaches> MeasureReaches(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                       const RunContext& context) {
  Reaches reaches;
  reaches.k = graph.k;
  reaches.distances.resize(graph.indices.size());
  reaches.mean.resize(static_cast<size_t>(graph.size()));
  reaches.middle.resize(static_cast<size_t>(graph.size()));
  const auto measure = [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      double sum = 0;
      for (int j = 0; j < graph.k; ++j) {
        const int neighbor = graph.indices[i * graph.k + j];
        const auto distance = static_cast<float>((points.col(neighbor) - points.col(i)).norm());
        reaches.distances[i * graph.k + j] = distance;
        sum += distance;
      }
      reaches.mean[i] = static_cast<float>(sum / graph.k);
      reaches.middle[i] = reaches.distances[i * graph.k + graph.k / 2];
    }
  };
  RILIEVO_RETURN_IF_ERROR(ParallelFor(graph.size(), kLightBlock, context, measure));
  return reaches;
}

// The mean distance usual around each point: the largest field below the means that grows by no
// more than `growth` along the graph. A cluster of flying points does not support itself.
absl::StatusOr<std::vector<float>> UsualDistances(const NeighborGraph& graph,
                                                  const Reaches& reaches, double growth,
                                                  const RunContext& context) {
  std::vector<float> usual = reaches.mean;
  const auto relax = [&](int64_t index) {
    const int i = static_cast<int>(index);
    const auto neighbors = graph.neighbors(i);
    const auto distances = reaches.of(i);
    float own = usual[i];
    for (int j = 0; j < graph.k; ++j) {
      const float step = static_cast<float>(growth) * distances[j];
      float& other = usual[neighbors[j]];
      own = std::min(own, other + step);
      other = std::min(other, own + step);
    }
    usual[i] = own;
  };
  // Points are in Morton order, so two sweeps each way carry a value across nearly all of the scan.
  for (int sweep = 0; sweep < 2; ++sweep) {
    RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, relax));
    RILIEVO_RETURN_IF_ERROR(
        SerialFor(graph.size(), context, [&](int64_t i) { relax(graph.size() - 1 - i); }));
  }
  return usual;
}

// How a point lies against the plane of its neighbours, itself not among them.
struct PlaneResidual {
  double height = 0;     // off the plane
  double thickness = 0;  // deviation of the neighbours from it
  double spread = 0;     // deviation of the neighbours along it
};

PlaneResidual StandingOf(const PatchMoments& patch, int neighbors) {
  // The patch holds the point at offset zero, where it adds nothing to the sums.
  const float share = static_cast<float>(neighbors + 1) / static_cast<float>(neighbors);
  PatchMoments others;
  others.mean_offset = share * patch.mean_offset;
  const Eigen::Vector3f& m = patch.mean_offset;
  const Eigen::Vector3f& o = others.mean_offset;
  Eigen::Matrix<float, 6, 1> own, other;
  own << m.x() * m.x(), m.x() * m.y(), m.x() * m.z(), m.y() * m.y(), m.y() * m.z(), m.z() * m.z();
  other << o.x() * o.x(), o.x() * o.y(), o.x() * o.z(), o.y() * o.y(), o.y() * o.z(), o.z() * o.z();
  others.covariance = share * (patch.covariance + own) - other;
  const PatchPlane plane = FitPlane(others);
  return {std::abs(plane.normal.dot(others.mean_offset.cast<double>())), std::sqrt(plane.thickness),
          std::sqrt(plane.spread)};
}

}  // namespace

absl::Status OutlierOptions::Validate() const {
  if (distance_factor != 0 && !(distance_factor >= 1.5 && std::isfinite(distance_factor))) {
    return absl::InvalidArgumentError(
        absl::StrCat("distance_factor: ", distance_factor, " is neither 0 (off) nor at least 1.5"));
  }
  if (!(min_component_share >= 0 && min_component_share <= 0.1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("min_component_share: ", min_component_share, " is outside [0, 0.1]"));
  }
  return absl::OkStatus();
}

namespace {

absl::StatusOr<std::vector<PlaneResidual>> AllPlaneResiduals(const Eigen::Matrix3Xd& points,
                                                             const NeighborGraph& graph,
                                                             const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<PatchMoments> patches,
                           ComputePatchMoments(points, graph, context));
  std::vector<PlaneResidual> residuals(patches.size());
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kLightBlock, context, [&](int64_t i) {
    residuals[i] = StandingOf(patches[i], graph.k);
  }));
  return residuals;
}

// At least 1: how much thicker than a sheet the scan is all over. Where noise is thicker than the
// spacing every point sits in a volume of points, and has to be further out to be an outlier.
double ScanThickness(const std::vector<PlaneResidual>& residuals) {
  std::vector<double> ratios;
  ratios.reserve(residuals.size());
  for (const PlaneResidual& residual : residuals) {
    if (residual.spread > 0) ratios.push_back(residual.thickness / residual.spread);
  }
  return std::max(1.0, Median(std::move(ratios)) / kRemoveOutliers.sheet);
}

// Drops the points of a cloud of outliers, which support each other beside a scan that is
// hardly denser: each lies in a volume that noise, as thick in all of the scan, does not explain,
// and so do half of its neighbours at least, unless they are dropped already.
absl::Status DropOutlierClouds(const NeighborGraph& graph, const Reaches& reaches,
                               const std::vector<float>& usual,
                               const std::vector<PlaneResidual>& residuals,
                               const RunContext& context, std::vector<uint8_t>* keep) {
  std::vector<double> thicknesses(residuals.size());
  std::transform(residuals.begin(), residuals.end(), thicknesses.begin(),
                 [](const PlaneResidual& residual) { return residual.thickness; });
  const double thick = kRemoveOutliers.thicknesses_off * Median(std::move(thicknesses));
  std::vector<uint8_t> in_volume(residuals.size());
  for (size_t i = 0; i < residuals.size(); ++i) {
    in_volume[i] = residuals[i].thickness >
                       std::max(thick, kRemoveOutliers.cloud_ratio * residuals[i].spread) &&
                   reaches.mean[i] > kRemoveOutliers.cloud_sparse * usual[i];
  }
  const std::vector<uint8_t> kept = *keep;
  return ParallelFor(graph.size(), kLightBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      if (!in_volume[i]) continue;
      const auto neighbors = graph.neighbors(static_cast<int>(i));
      const auto strays = std::count_if(neighbors.begin(), neighbors.end(),
                                        [&](int j) { return in_volume[j] || !kept[j]; });
      if (2 * strays >= graph.k) (*keep)[i] = 0;
    }
  });
}

// The marks of a point that belongs to no surface:
// - it is sparse and its neighbours form no sheet that it lies in,
// - it is sparse beyond any sheet, or a little sparse in a volume of points,
// - it stands off a sheet by more than the sheet is thick and its points are apart,
// - it is one of a cloud of outliers (DropOutlierClouds).
absl::Status MarkOutliers(const Eigen::Matrix3Xd& points, const NeighborGraph& graph, double factor,
                          const RunContext& context, std::vector<uint8_t>* keep) {
  if (IsLeftOut(Mechanism::kOutliers)) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(Reaches reaches, MeasureReaches(points, graph, context));
  // Each is a chain of steps, so the two go side by side.
  std::array<absl::StatusOr<std::vector<float>>, 2> fields;
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(2, 1, context, [&](int64_t i) {
    fields[i] = UsualDistances(
        graph, reaches, i == 0 ? kRemoveOutliers.spacing_growth : kRemoveOutliers.growth_off_sheets,
        context);
  }));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> usual, std::move(fields[0]));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> usual_off_sheets, std::move(fields[1]));
  reaches.distances = std::vector<float>();  // only their summaries are asked for from here
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<PlaneResidual> residuals,
                           AllPlaneResiduals(points, graph, context));
  const double thick = ScanThickness(residuals);
  for (int i = 0; i < graph.size(); ++i) {
    const PlaneResidual& residual = residuals[i];
    const double limit = factor * usual[i];
    const bool in_sheet = residual.thickness < kRemoveOutliers.sheet_ratio * residual.spread &&
                          residual.height < kRemoveOutliers.thicknesses_off * residual.thickness;
    const bool off_sheet = residual.height > kRemoveOutliers.thicknesses_off * residual.thickness &&
                           residual.height > kRemoveOutliers.off_usual * thick * limit;
    const bool in_volume =
        residual.thickness > kRemoveOutliers.volume_ratio * thick * residual.spread &&
        reaches.middle[i] > kRemoveOutliers.volume_sparse * limit;
    const bool sparse = reaches.middle[i] > limit;  // half of the neighbours lie farther
    const bool rejected = reaches.mean[i] > kRemoveOutliers.reject * limit;
    if (off_sheet || in_volume || (sparse && (!in_sheet || rejected))) (*keep)[i] = 0;
  }
  if (IsLeftOut(Mechanism::kOutlierClouds)) return absl::OkStatus();
  return DropOutlierClouds(graph, reaches, usual_off_sheets, residuals, context, keep);
}

}  // namespace

absl::StatusOr<OutlierResult> FindOutliers(const Eigen::Matrix3Xd& points,
                                           const NeighborGraph& graph,
                                           const OutlierOptions& options,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  OutlierResult result;
  result.keep.assign(static_cast<size_t>(points.cols()), 1);
  if (options.distance_factor > 0) {
    RILIEVO_RETURN_IF_ERROR(
        MarkOutliers(points, graph, options.distance_factor, context, &result.keep));
  }
  result.outliers = std::count(result.keep.begin(), result.keep.end(), 0);
  const double smallest =
      std::min<double>(kRemoveOutliers.largest_island, options.min_component_share * graph.size());
  SignedUnionFind sets(graph.size());
  // Of sets known not to be islands: two such need not be joined.
  std::vector<uint8_t> in_large_component(static_cast<size_t>(graph.size()), 0);
  RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t index) {
    const int i = static_cast<int>(index);
    if (!result.keep[i]) return;
    for (const int j : graph.neighbors(i)) {
      if (!result.keep[j] || (in_large_component[i] & in_large_component[j]) != 0) continue;
      sets.Join(i, j, 0);
      if (sets.size(sets.Find(i)) >= smallest) in_large_component[i] = in_large_component[j] = 1;
    }
  }));
  for (int i = 0; i < graph.size(); ++i) {
    if (!result.keep[i] || sets.size(sets.Find(i)) >= smallest) continue;
    result.keep[i] = 0;
    ++result.island_points;
  }
  return result;
}

}  // namespace rilievo
