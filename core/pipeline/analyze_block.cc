#include "core/pipeline/analyze_block.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace rilievo {

OrientedCloud CloudInScanFrame(ScanSurface scan) {
  const SpatialFrame& frame = scan.frame;
  OrientedCloud cloud = std::move(scan.cloud);
  for (auto point : cloud.points.colwise()) point = frame.ScanFromUnit(point);
  const auto scale = static_cast<float>(frame.diagonal);
  for (float& spacing : cloud.spacing) spacing *= scale;
  for (float& noise : cloud.noise) noise *= scale;
  cloud.median_spacing *= frame.diagonal;
  cloud.median_noise *= frame.diagonal;
  return cloud;
}

absl::StatusOr<AnalyzedBlock> AnalyzeBlock(const Eigen::Matrix3Xd& points, int64_t points_of_scan,
                                           const SpatialFrame& curve, const ScanSurface& coarse,
                                           const ReconstructOptions& options,
                                           const RunContext& context) {
  PointCloud block;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           coarse.index.NearestOfEach(points, context));
  block.points = points;
  block.sights.normals = coarse.cloud.normals(Eigen::all, nearest).cast<float>();
  ScanOptions of_block = options.scan;
  of_block.sights = {SightRule::kIgnore, SightRule::kUse};
  // Islands are as large as they would have to be in the whole.
  of_block.outliers.min_component_share =
      std::min(0.1, options.scan.outliers.min_component_share *
                        static_cast<double>(points_of_scan) / static_cast<double>(points.cols()));
  absl::StatusOr<CheckedScan> checked = CheckScan(block, options.check, context, curve);
  block = PointCloud();
  AnalyzedBlock found;
  if (absl::IsInvalidArgument(checked.status())) return found;
  RILIEVO_RETURN_IF_ERROR(checked.status());
  found.source = std::move(checked->source_index);
  absl::StatusOr<ScanSurface> analyzed = AnalyzeScan(*std::move(checked), of_block, context);
  if (absl::IsInvalidArgument(analyzed.status())) return AnalyzedBlock();
  RILIEVO_RETURN_IF_ERROR(analyzed.status());
  size_t kept = 0;
  for (size_t i = 0; i < analyzed->keep.size(); ++i) {
    if (analyzed->keep[i] != 0) found.source[kept++] = found.source[i];
  }
  if (!analyzed->keep.empty()) found.source.resize(kept);
  found.cloud = CloudInScanFrame(*std::move(analyzed));
  return found;
}

}  // namespace rilievo
