#include "core/scan/scan_surface.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/local_shape/estimate_normals.h"
#include "core/scan/local_shape/separate_sheets.h"
#include "core/scan/local_shape/sharpen_normals.h"
#include "core/scan/local_shape/thick_noise.h"

namespace rilievo {
namespace {

// The kept points and the way from the old numbering to theirs.
struct KeptPoints {
  Eigen::Matrix3Xd points;  // rescaled so that their bounding box has diagonal 1
  SpatialFrame frame;
  NeighborGraph graph;         // in the old numbering
  std::vector<int> new_index;  // by old index, -1: dropped
};

// Carries points from one unit frame to another.
void Reframe(const SpatialFrame& from, const SpatialFrame& to, Eigen::Matrix3Xd* points) {
  const SpatialFrame between = Between(to, from);
  for (auto point : points->colwise()) point = between.UnitFromScan(point);
}

// Takes them out of a scan, whose index and sights go.
KeptPoints Compact(const std::vector<uint8_t>& keep, ScanNeighbors scan) {
  KeptPoints kept{std::move(scan.points), scan.frame, std::move(scan.graph), {}};
  kept.new_index.assign(keep.size(), -1);
  int count = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    kept.points.col(count) = kept.points.col(static_cast<int64_t>(i));
    kept.new_index[i] = count++;
  }
  kept.points.conservativeResize(3, count);
  const Eigen::Vector3d low = kept.points.rowwise().minCoeff();
  const Eigen::Vector3d high = kept.points.rowwise().maxCoeff();
  if (!((high - low).norm() > 0)) return kept;
  kept.frame = Rounded(
      {scan.frame.ScanFromUnit((low + high) / 2), scan.frame.diagonal * (high - low).norm()});
  Reframe(scan.frame, kept.frame, &kept.points);
  return kept;
}

// Makes the graph that of the kept points, in its own memory: all lists are renumbered, those that
// lost a neighbour asked for anew.
absl::Status RepairGraph(const PointIndex& index, const RunContext& context, KeptPoints* repaired) {
  KeptPoints& kept = *repaired;
  NeighborGraph* const graph = &kept.graph;
  const int k = graph->k;
  std::vector<int>& indices = graph->indices;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(static_cast<int64_t>(indices.size()), kSearchBlock * k,
                                      context, [&](int64_t begin, int64_t end) {
                                        for (int64_t i = begin; i < end; ++i) {
                                          indices[i] = kept.new_index[indices[i]];
                                        }
                                      }));
  for (size_t old = 0; old < kept.new_index.size(); ++old) {
    if (kept.new_index[old] < 0) continue;
    std::copy_n(indices.begin() + static_cast<int64_t>(old) * k, k,
                indices.begin() + static_cast<int64_t>(kept.new_index[old]) * k);
  }
  indices.resize(static_cast<size_t>(kept.points.cols()) * k);
  return ParallelFor(kept.points.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto list = graph->neighbors(static_cast<int>(i));
      if (std::find(list.begin(), list.end(), -1) == list.end()) continue;
      ListNeighbors(index, kept.points, static_cast<int>(i), k, &indices[i * k]);
    }
  });
}

// The points that belong to a surface, in a frame of their own.
absl::StatusOr<ScanNeighbors> WithoutOutliers(ScanNeighbors scan, const ScanOptions& options,
                                              const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(OutlierResult found,
                           FindOutliers(scan.points, scan.graph, options.outliers, context));
  const int64_t checked = scan.points.cols();
  const int64_t count = checked - std::count(found.keep.begin(), found.keep.end(), 0);
  scan.figures.outliers = found.outliers;
  scan.figures.island_points = found.island_points;
  scan.figures.kept = count;
  if (count < kMinScanPoints) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", count, " of ", checked, " points are left after ", found.outliers,
                     " outliers and ", found.island_points, " points of islands, at least ",
                     kMinScanPoints, " are needed"));
  }
  if (count == checked) return scan;
  const SpatialFrame curve = scan.curve;
  const ScanFigures figures = scan.figures;
  PointSights sights = std::move(scan.sights);
  KeepSights(found.keep, &sights);
  const SpatialFrame before = scan.frame;
  KeptPoints kept = Compact(found.keep, std::move(scan));
  Reframe(before, kept.frame, &sights.stations);
  RILIEVO_ASSIGN_OR_RETURN(PointIndex index,
                           PointIndex::Build(kept.points, context, Between(kept.frame, curve)));
  if (count > kept.graph.k) {
    RILIEVO_RETURN_IF_ERROR(RepairGraph(index, context, &kept));
  } else {  // each list gets shorter
    RILIEVO_ASSIGN_OR_RETURN(kept.graph,
                             BuildNeighborGraph(index, kept.points, options.neighbors, context));
  }
  return ScanNeighbors{
      std::move(kept.points), std::move(sights), kept.frame, curve,
      std::move(kept.graph),  std::move(index),  figures,    std::move(found.keep)};
}

}  // namespace

absl::Status ScanOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(neighbors.Validate());
  return outliers.Validate();
}

absl::StatusOr<ScanNeighbors> FindNeighbors(CheckedScan scan, const ScanOptions& options,
                                            const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (scan.points.cols() < kMinScanPoints) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", scan.points.cols(), " points, at least ", kMinScanPoints, " are needed"));
  }
  context.Report(Stage::kNeighbors, 0);
  const SpatialFrame curve = scan.frame, frame = Rounded(curve);
  Reframe(curve, frame, &scan.points);
  Reframe(curve, frame, &scan.sights.stations);
  RILIEVO_ASSIGN_OR_RETURN(PointIndex index,
                           PointIndex::Build(scan.points, context, Between(frame, curve)));
  RILIEVO_ASSIGN_OR_RETURN(NeighborGraph graph,
                           BuildNeighborGraph(index, scan.points, options.neighbors, context));
  context.Report(Stage::kNeighbors, 1);
  ScanFigures figures;
  figures.non_finite = scan.non_finite;
  figures.duplicates = scan.duplicates;
  figures.strays = scan.strays;
  return ScanNeighbors{std::move(scan.points), std::move(scan.sights), frame,  curve,
                       std::move(graph),       std::move(index),       figures};
}

absl::StatusOr<ScanSurface> OrientScan(ScanNeighbors scan, const ScanOptions& options,
                                       const RunContext& context) {
  context.Report(Stage::kNormals, 0);
  RILIEVO_ASSIGN_OR_RETURN(scan, WithoutOutliers(std::move(scan), options, context));
  context.Report(Stage::kNormals, 0.2);
  NeighborGraph graph = std::move(scan.graph);
  RILIEVO_ASSIGN_OR_RETURN(const ReplacedLists replaced,
                           SeparateSheets(scan.points, scan.index, context, &graph));
  std::optional<PointIndex> index = std::move(scan.index);
  const bool is_large = scan.points.cols() >= kLargeScan;
  if (is_large) index.reset();  // normals need the room
  RILIEVO_ASSIGN_OR_RETURN(EstimatedNormals estimated,
                           EstimateNormals(std::move(scan.points), graph, replaced, context));
  OrientedCloud cloud = std::move(estimated.cloud);
  context.Report(Stage::kNormals, 0.6);
  std::vector<Rgb> colors = std::move(scan.sights.colors);
  RILIEVO_ASSIGN_OR_RETURN(
      scan.figures.orientation,
      OrientNormals(graph, std::move(scan.sights), options.sights, &cloud, context));
  RILIEVO_RETURN_IF_ERROR(SharpenNormals(graph, estimated.near_edge, context, &cloud));
  JoinSheets(replaced, &graph);
  if (is_large) {
    RILIEVO_RETURN_IF_ERROR(graph.Pack(context));
    RILIEVO_ASSIGN_OR_RETURN(
        index, PointIndex::BuildOver(cloud.points, context, Between(scan.frame, scan.curve)));
  }
  RILIEVO_RETURN_IF_ERROR(CorrectThickNoise(*index, context, &cloud));
  context.Report(Stage::kNormals, 1);
  return ScanSurface{std::move(cloud), std::move(colors), std::move(graph),    *std::move(index),
                     scan.frame,       scan.figures,      std::move(scan.keep)};
}

absl::StatusOr<ScanSurface> AnalyzeScan(CheckedScan scan, const ScanOptions& options,
                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ScanNeighbors neighbors,
                           FindNeighbors(std::move(scan), options, context));
  return OrientScan(std::move(neighbors), options, context);
}

}  // namespace rilievo
