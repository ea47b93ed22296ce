#include "core/scan/scan_surface.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/scan/clean/find_foliage.h"
#include "core/scan/clean/settings.h"
#include "core/scan/local_shape/estimate_normals.h"
#include "core/scan/local_shape/separate_sheets.h"
#include "core/scan/local_shape/sharpen_normals.h"
#include "core/scan/local_shape/thick_noise.h"
#include "core/scan/settings.h"

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
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(static_cast<int64_t>(indices.size()), kSearchBlock * k, context,
                      [&](int64_t i) { indices[i] = kept.new_index[indices[i]]; }));
  for (size_t old = 0; old < kept.new_index.size(); ++old) {
    if (kept.new_index[old] < 0) continue;
    std::copy_n(indices.begin() + static_cast<int64_t>(old) * k, k,
                indices.begin() + static_cast<int64_t>(kept.new_index[old]) * k);
  }
  indices.resize(static_cast<size_t>(kept.points.cols()) * k);
  return ParallelForEach(kept.points.cols(), kSearchBlock, context, [&](int64_t i) {
    const auto list = graph->neighbors(static_cast<int>(i));
    if (std::find(list.begin(), list.end(), -1) == list.end()) return;
    ListNeighbors(index, kept.points, static_cast<int>(i), k, &indices[i * k]);
  });
}

// INVALID_ARGUMENT where too few are left.
absl::Status CheckKept(const ScanFigures& figures) {
  if (figures.kept >= kCheckScan.min_scan_points) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("points: ", figures.kept, " of ",
                   figures.kept + figures.outliers + figures.island_points + figures.foliage_points,
                   " points are left after ", figures.outliers, " outliers, ",
                   figures.island_points, " points of islands and ", figures.foliage_points,
                   " points of foliage, at least ", kCheckScan.min_scan_points, " are needed"));
}

// The mask of all points for one of those that another mask has kept so far.
std::vector<uint8_t> KeptOfAll(std::vector<uint8_t> so_far, const std::vector<uint8_t>& keep) {
  if (so_far.empty()) return keep;
  size_t next = 0;
  for (uint8_t& kept : so_far) {
    if (kept != 0) kept = keep[next++];
  }
  return so_far;
}

// Those of the points that are to be kept, in a frame of their own.
absl::StatusOr<ScanNeighbors> KeepPoints(const std::vector<uint8_t>& keep, ScanNeighbors scan,
                                         const ScanOptions& options, const RunContext& context) {
  const SpatialFrame curve = scan.curve;
  const ScanFigures figures = scan.figures;
  std::vector<uint8_t> kept_of_all = KeptOfAll(std::move(scan.keep), keep);
  PointSights sights = std::move(scan.sights);
  KeepSights(keep, &sights);
  const SpatialFrame before = scan.frame;
  KeptPoints kept = Compact(keep, std::move(scan));
  Reframe(before, kept.frame, &sights.stations);
  RILIEVO_ASSIGN_OR_RETURN(PointIndex index,
                           PointIndex::Build(kept.points, context, Between(kept.frame, curve)));
  if (kept.points.cols() > kept.graph.k) {
    RILIEVO_RETURN_IF_ERROR(RepairGraph(index, context, &kept));
  } else {  // each list gets shorter
    RILIEVO_ASSIGN_OR_RETURN(kept.graph,
                             BuildNeighborGraph(index, kept.points, options.neighbors, context));
  }
  return ScanNeighbors{
      std::move(kept.points), std::move(sights), kept.frame, curve,
      std::move(kept.graph),  std::move(index),  figures,    std::move(kept_of_all)};
}

// Once more where many went, for those left are then judged by better neighbours. Of sparse scenes
// without outliers one point in a hundred goes.
absl::StatusOr<ScanNeighbors> WithoutOutliers(ScanNeighbors scan, const ScanOptions& options,
                                              const RunContext& context) {
  for (int look = 0; look < 2; ++look) {
    RILIEVO_ASSIGN_OR_RETURN(const OutlierResult found,
                             FindOutliers(scan.points, scan.graph, options.outliers, context));
    const int64_t checked = scan.points.cols();
    scan.figures.outliers += found.outliers;
    scan.figures.island_points += found.island_points;
    scan.figures.kept = std::count(found.keep.begin(), found.keep.end(), 1);
    RILIEVO_RETURN_IF_ERROR(CheckKept(scan.figures));
    if (scan.figures.kept == checked) return scan;
    RILIEVO_ASSIGN_OR_RETURN(scan, KeepPoints(found.keep, std::move(scan), options, context));
    if (static_cast<double>(found.outliers) < kScanSurface.many * static_cast<double>(checked))
      return scan;
  }
  return scan;
}

// The points of a scan with their normals, of either sign.
struct NormalsOfScan {
  ReplacedLists replaced;
  EstimatedNormals estimated;
};

// Of a scan whose graph is by sheets. Takes its points, and the index too where there are many.
absl::StatusOr<NormalsOfScan> FindNormals(ReplacedLists replaced, ScanNeighbors* scan,
                                          const RunContext& context) {
  NormalsOfScan found;
  found.replaced = std::move(replaced);
  if (scan->points.cols() >= kLargeScan) PointIndex(std::move(scan->index));  // for its room
  RILIEVO_ASSIGN_OR_RETURN(found.estimated,
                           EstimateNormals(std::move(scan->points), scan->graph, found.replaced,
                                           Between(scan->curve, scan->frame), context));
  return found;
}

absl::StatusOr<ReplacedLists> SeparateScan(ScanNeighbors* scan, const RunContext& context) {
  return SeparateSheets(scan->points, scan->index, Between(scan->curve, scan->frame), context,
                        &scan->graph);
}

// Takes foliage out of a scan whose graph is by sheets. Its normals, where there was none to take
// out; unset: there was, and the graph is not by sheets any longer.
absl::StatusOr<std::optional<NormalsOfScan>> RemoveFoliage(ReplacedLists replaced,
                                                           ScanNeighbors* scan,
                                                           const ScanOptions& options,
                                                           const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(NormalsOfScan found, FindNormals(std::move(replaced), scan, context));
  const int64_t checked = scan->graph.size();
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> keep,
                           FindFoliage(found.estimated.cloud, scan->graph, context));
  scan->figures.foliage_points = std::count(keep.begin(), keep.end(), 1);
  if (scan->figures.foliage_points == 0) return found;
  for (uint8_t& kept : keep) kept = kept == 0;
  scan->figures.kept = checked - scan->figures.foliage_points;
  RILIEVO_RETURN_IF_ERROR(CheckKept(scan->figures));
  JoinSheets(found.replaced, &scan->graph);
  scan->points = std::move(found.estimated.cloud.points);
  found = NormalsOfScan();
  RILIEVO_ASSIGN_OR_RETURN(*scan, KeepPoints(keep, std::move(*scan), options, context));
  // Those at its edge stand alone now.
  RILIEVO_ASSIGN_OR_RETURN(*scan, WithoutOutliers(std::move(*scan), options, context));
  return std::nullopt;
}

absl::StatusOr<bool> LooksForFoliage(const ScanNeighbors& scan, const ScanOptions& options,
                                     const RunContext& context) {
  if (options.outliers.distance_factor == 0) return false;
  return MayHoldFoliage(scan.points, scan.graph, context);
}

// As FindNormals, of what is left without foliage.
absl::StatusOr<NormalsOfScan> FindNormalsWithoutFoliage(ScanNeighbors* scan,
                                                        const ScanOptions& options,
                                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ReplacedLists replaced, SeparateScan(scan, context));
  RILIEVO_ASSIGN_OR_RETURN(const bool looks, LooksForFoliage(*scan, options, context));
  if (looks) {
    RILIEVO_ASSIGN_OR_RETURN(std::optional<NormalsOfScan> found,
                             RemoveFoliage(std::move(replaced), scan, options, context));
    if (found) return *std::move(found);
    RILIEVO_ASSIGN_OR_RETURN(replaced, SeparateScan(scan, context));
  }
  return FindNormals(std::move(replaced), scan, context);
}

}  // namespace

absl::Status ScanOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(neighbors.Validate());
  return outliers.Validate();
}

absl::StatusOr<ScanNeighbors> FindNeighbors(CheckedScan scan, const ScanOptions& options,
                                            const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (scan.points.cols() < kCheckScan.min_scan_points) {
    return absl::InvalidArgumentError(absl::StrCat("points: ", scan.points.cols(),
                                                   " points, at least ", kCheckScan.min_scan_points,
                                                   " are needed"));
  }
  context.Report(Stage::kNeighbors, 0);
  const SpatialFrame curve = scan.curve, frame = Rounded(scan.frame);
  Reframe(scan.frame, frame, &scan.points);
  Reframe(scan.frame, frame, &scan.sights.stations);
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

absl::StatusOr<std::vector<uint8_t>> FindKept(ScanNeighbors scan, const ScanOptions& options,
                                              const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(scan, WithoutOutliers(std::move(scan), options, context));
  if (options.outliers.distance_factor == 0) return std::move(scan.keep);
  RILIEVO_ASSIGN_OR_RETURN(ReplacedLists replaced, SeparateScan(&scan, context));
  RILIEVO_ASSIGN_OR_RETURN(const bool looks, LooksForFoliage(scan, options, context));
  if (looks) {
    RILIEVO_RETURN_IF_ERROR(RemoveFoliage(std::move(replaced), &scan, options, context).status());
  }
  return std::move(scan.keep);
}

absl::StatusOr<ScanSurface> OrientScan(ScanNeighbors scan, const ScanOptions& options,
                                       const RunContext& context) {
  context.Report(Stage::kNormals, 0);
  RILIEVO_ASSIGN_OR_RETURN(scan, WithoutOutliers(std::move(scan), options, context));
  context.Report(Stage::kNormals, 0.2);
  RILIEVO_ASSIGN_OR_RETURN(NormalsOfScan found, FindNormalsWithoutFoliage(&scan, options, context));
  OrientedCloud cloud = std::move(found.estimated.cloud);
  NeighborGraph graph = std::move(scan.graph);
  context.Report(Stage::kNormals, 0.6);
  std::vector<Rgb> colors = std::move(scan.sights.colors);
  RILIEVO_ASSIGN_OR_RETURN(
      scan.figures.orientation,
      OrientNormals(graph, std::move(scan.sights), options.sights, &cloud, context));
  RILIEVO_RETURN_IF_ERROR(SharpenNormals(graph, found.estimated.near_edge, context, &cloud));
  JoinSheets(found.replaced, &graph);
  std::optional<PointIndex> index = std::move(scan.index);
  if (cloud.points.cols() >= kLargeScan) {
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
