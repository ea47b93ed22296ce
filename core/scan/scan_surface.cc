#include "core/scan/scan_surface.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/normals.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 1024;

// The kept points and the way from the old numbering to theirs.
struct KeptPoints {
  Eigen::Matrix3Xd points;     // rescaled so that their bounding box has diagonal 1
  std::vector<int> old_index;  // by new index
  std::vector<int> new_index;  // by old index, -1: dropped
  SpatialFrame frame;
};

// A frame travels in every file: the diagonal keeps 20 binary digits after the first, the centre
// lies on a grid of about a thousandth of it, so they take 15 bytes and not 32.
SpatialFrame RoundedFrame(const Eigen::Vector3d& center, double diagonal) {
  int exponent = 0;
  std::frexp(diagonal, &exponent);
  constexpr int kDiagonalDigits = 21, kGrid = 10;
  const auto rounded = [](double value, int digit) {
    return std::ldexp(std::nearbyint(std::ldexp(value, -digit)), digit);
  };
  SpatialFrame frame;
  frame.diagonal = rounded(diagonal, exponent - kDiagonalDigits);
  for (int axis = 0; axis < 3; ++axis) {
    frame.center[axis] = rounded(center[axis], exponent - 1 - kGrid);
  }
  return frame;
}

KeptPoints Compact(const CheckedScan& scan, const std::vector<uint8_t>& keep) {
  KeptPoints kept;
  kept.new_index.assign(keep.size(), -1);
  for (size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    kept.new_index[i] = static_cast<int>(kept.old_index.size());
    kept.old_index.push_back(static_cast<int>(i));
  }
  kept.frame = scan.frame;
  if (kept.old_index.empty()) return kept;
  kept.points.resize(3, static_cast<int64_t>(kept.old_index.size()));
  for (size_t i = 0; i < kept.old_index.size(); ++i) {
    kept.points.col(i) = scan.points.col(kept.old_index[i]);
  }
  const Eigen::Vector3d low = kept.points.rowwise().minCoeff();
  const Eigen::Vector3d high = kept.points.rowwise().maxCoeff();
  if (!((high - low).norm() > 0)) return kept;
  kept.frame = RoundedFrame(scan.frame.ScanFromUnit((low + high) / 2),
                            scan.frame.diagonal * (high - low).norm());
  const Eigen::Vector3d center = scan.frame.UnitFromScan(kept.frame.center);
  kept.points = (kept.points.colwise() - center) / (kept.frame.diagonal / scan.frame.diagonal);
  return kept;
}

// The graph of the kept points: lists that lost nobody are renumbered, the others asked again.
absl::StatusOr<NeighborGraph> RepairGraph(const NeighborGraph& old, const KeptPoints& kept,
                                          const PointIndex& index, double scale,
                                          const RunContext& context) {
  NeighborGraph graph;
  graph.k = old.k;
  const int k = graph.k;
  graph.indices.resize(kept.old_index.size() * k);
  graph.distances.resize(graph.indices.size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(kept.old_index.size()), kBlock, context,
      [&](int64_t begin, int64_t end) {
        std::vector<int> nearest(k + 1);
        std::vector<double> squared(k + 1);
        for (int64_t i = begin; i < end; ++i) {
          const auto neighbors = old.neighbors(kept.old_index[i]);
          const auto distances = old.neighbor_distances(kept.old_index[i]);
          bool whole = true;
          for (int j = 0; j < k; ++j) {
            graph.indices[i * k + j] = kept.new_index[neighbors[j]];
            graph.distances[i * k + j] = static_cast<float>(distances[j] * scale);
            whole = whole && kept.new_index[neighbors[j]] >= 0;
          }
          if (whole) continue;
          index.Nearest(kept.points.col(i), k + 1, nearest.data(), squared.data());
          for (int from = 0, to = 0; to < k; ++from) {
            if (nearest[from] == i) continue;
            graph.indices[i * k + to] = nearest[from];
            graph.distances[i * k + to++] = static_cast<float>(std::sqrt(squared[from]));
          }
        }
      }));
  return graph;
}

}  // namespace

absl::Status ScanOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(neighbors.Validate());
  return outliers.Validate();
}

absl::StatusOr<ScanSurface> AnalyzeScan(const CheckedScan& scan, const ScanOptions& options,
                                        const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (scan.points.cols() < kMinScanPoints) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", scan.points.cols(), " points, at least ", kMinScanPoints, " are needed"));
  }
  context.Report(Stage::kNeighbors, 0);
  RILIEVO_ASSIGN_OR_RETURN(PointIndex index, PointIndex::Build(scan.points, context));
  RILIEVO_ASSIGN_OR_RETURN(NeighborGraph graph,
                           BuildNeighborGraph(index, scan.points, options.neighbors, context));
  context.Report(Stage::kNeighbors, 1);
  context.Report(Stage::kNormals, 0);
  RILIEVO_ASSIGN_OR_RETURN(const OutlierResult found,
                           FindOutliers(scan.points, graph, options.outliers, context));
  context.Report(Stage::kNormals, 0.2);
  const KeptPoints kept = Compact(scan, found.keep);
  if (kept.points.cols() < kMinScanPoints) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", kept.points.cols(), " of ", scan.points.cols(), " points are left after ",
        found.outliers, " outliers and ", found.island_points, " points of islands, at least ",
        kMinScanPoints, " are needed"));
  }
  if (kept.points.cols() < scan.points.cols()) {
    RILIEVO_ASSIGN_OR_RETURN(index, PointIndex::Build(kept.points, context));
    if (kept.points.cols() > graph.k) {
      const double scale = scan.frame.diagonal / kept.frame.diagonal;
      RILIEVO_ASSIGN_OR_RETURN(graph, RepairGraph(graph, kept, index, scale, context));
    } else {  // each list gets shorter
      RILIEVO_ASSIGN_OR_RETURN(graph,
                               BuildNeighborGraph(index, kept.points, options.neighbors, context));
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(OrientedCloud cloud, EstimateNormals(kept.points, graph, context));
  context.Report(Stage::kNormals, 0.6);
  RILIEVO_ASSIGN_OR_RETURN(const OrientationResult orientation,
                           OrientNormals(graph, &cloud, context));
  context.Report(Stage::kNormals, 1);
  return ScanSurface{std::move(cloud), std::move(graph),    std::move(index), kept.frame,
                     found.outliers,   found.island_points, orientation};
}

}  // namespace rilievo
