#include "core/scan/scan_surface.h"

#include <cmath>
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

constexpr int64_t kBlock = 1024;
// From here on 45 bytes a point count for more than the hundredth of the time that they save.
constexpr int64_t kManyPoints = 200'000;

// The kept points and the way from the old numbering to theirs.
struct KeptPoints {
  Eigen::Matrix3Xd points;     // rescaled so that their bounding box has diagonal 1
  std::vector<int> new_index;  // by old index, -1: dropped
  SpatialFrame frame;
};

// Carries points from one unit frame to another.
void Reframe(const SpatialFrame& from, const SpatialFrame& to, Eigen::Matrix3Xd* points) {
  const SpatialFrame between = Between(to, from);
  for (auto point : points->colwise()) point = between.UnitFromScan(point);
}

// Takes the points out of `scan`. Where nothing is dropped, they and their frame stay as they are.
KeptPoints Compact(const std::vector<uint8_t>& keep, CheckedScan* scan) {
  KeptPoints kept;
  kept.frame = scan->frame;
  kept.new_index.assign(keep.size(), -1);
  int count = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) kept.new_index[i] = count++;
  }
  kept.points = std::move(scan->points);
  if (count == static_cast<int>(keep.size())) return kept;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) kept.points.col(kept.new_index[i]) = kept.points.col(static_cast<int64_t>(i));
  }
  kept.points.conservativeResize(3, count);
  if (count == 0) return kept;
  const Eigen::Vector3d low = kept.points.rowwise().minCoeff();
  const Eigen::Vector3d high = kept.points.rowwise().maxCoeff();
  if (!((high - low).norm() > 0)) return kept;
  kept.frame = Rounded(
      {scan->frame.ScanFromUnit((low + high) / 2), scan->frame.diagonal * (high - low).norm()});
  Reframe(scan->frame, kept.frame, &kept.points);
  return kept;
}

// Makes the graph that of the kept points, in its own memory: all lists are renumbered, those that
// lost a neighbour asked for anew.
absl::Status RepairGraph(const KeptPoints& kept, const PointIndex& index, const RunContext& context,
                         NeighborGraph* graph) {
  const int k = graph->k;
  std::vector<int>& indices = graph->indices;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(static_cast<int64_t>(indices.size()), kBlock * k, context,
                                      [&](int64_t begin, int64_t end) {
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
  return ParallelFor(kept.points.cols(), kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto list = graph->neighbors(static_cast<int>(i));
      if (std::find(list.begin(), list.end(), -1) == list.end()) continue;
      ListNeighbors(index, kept.points, static_cast<int>(i), k, &indices[i * k]);
    }
  });
}

}  // namespace

absl::Status ScanOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(neighbors.Validate());
  return outliers.Validate();
}

absl::StatusOr<ScanSurface> AnalyzeScan(CheckedScan scan, const ScanOptions& options,
                                        const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (scan.points.cols() < kMinScanPoints) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", scan.points.cols(), " points, at least ", kMinScanPoints, " are needed"));
  }
  context.Report(Stage::kNeighbors, 0);
  const SpatialFrame sorted = scan.frame;  // the points are in the order of its Morton curve
  scan.frame = Rounded(sorted);
  Reframe(sorted, scan.frame, &scan.points);
  const auto build_index = [&](const Eigen::Matrix3Xd& points, const SpatialFrame& frame) {
    return PointIndex::Build(points, context, Between(frame, sorted));
  };
  std::optional<PointIndex> index;
  RILIEVO_ASSIGN_OR_RETURN(index, build_index(scan.points, scan.frame));
  RILIEVO_ASSIGN_OR_RETURN(NeighborGraph graph,
                           BuildNeighborGraph(*index, scan.points, options.neighbors, context));
  context.Report(Stage::kNeighbors, 1);
  context.Report(Stage::kNormals, 0);
  RILIEVO_ASSIGN_OR_RETURN(const OutlierResult found,
                           FindOutliers(scan.points, graph, options.outliers, context));
  context.Report(Stage::kNormals, 0.2);
  const int64_t checked = scan.points.cols();
  KeptPoints kept = Compact(found.keep, &scan);
  scan = {};
  const int64_t count = kept.points.cols();
  if (count < kMinScanPoints) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", count, " of ", checked, " points are left after ", found.outliers,
                     " outliers and ", found.island_points, " points of islands, at least ",
                     kMinScanPoints, " are needed"));
  }
  if (count < checked) {
    index.reset();
    RILIEVO_ASSIGN_OR_RETURN(index, build_index(kept.points, kept.frame));
    if (count > graph.k) {
      RILIEVO_RETURN_IF_ERROR(RepairGraph(kept, *index, context, &graph));
    } else {  // each list gets shorter
      RILIEVO_ASSIGN_OR_RETURN(graph,
                               BuildNeighborGraph(*index, kept.points, options.neighbors, context));
    }
  }
  kept.new_index = std::vector<int>();
  RILIEVO_ASSIGN_OR_RETURN(const ReplacedLists replaced,
                           SeparateSheets(kept.points, *index, context, &graph));
  const bool is_large = count >= kManyPoints;
  if (is_large) {  // made again below; normals need the room
    index.reset();
    ReleaseToOs();
  }
  RILIEVO_ASSIGN_OR_RETURN(EstimatedNormals estimated,
                           EstimateNormals(std::move(kept.points), graph, replaced, context));
  OrientedCloud cloud = std::move(estimated.cloud);
  context.Report(Stage::kNormals, 0.6);
  RILIEVO_ASSIGN_OR_RETURN(const OrientationResult orientation,
                           OrientNormals(graph, &cloud, context));
  RILIEVO_RETURN_IF_ERROR(SharpenNormals(graph, estimated.near_edge, context, &cloud));
  JoinSheets(replaced, &graph);
  if (is_large) {
    RILIEVO_RETURN_IF_ERROR(graph.Pack(context));
    RILIEVO_ASSIGN_OR_RETURN(
        index, PointIndex::BuildOver(cloud.points, context, Between(kept.frame, sorted)));
  }
  RILIEVO_RETURN_IF_ERROR(CorrectThickNoise(*index, context, &cloud));
  context.Report(Stage::kNormals, 1);
  return ScanSurface{std::move(cloud), std::move(graph),    *std::move(index), kept.frame,
                     found.outliers,   found.island_points, orientation};
}

}  // namespace rilievo
