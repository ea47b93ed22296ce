#include <optional>
#include <utility>

#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/option_lengths.h"
#include "core/pipeline/shape_input.h"

namespace rilievo {
namespace {

struct CheckedInput {
  CheckedScan scan;
  std::string hash;
};

// The check keeps one thread busy, and the hash another.
absl::StatusOr<CheckedInput> CheckInput(const PointCloud& scan, const ReconstructOptions& options,
                                        const PipelineContext& context) {
  const StageScope scope(Stage::kCheck, context);
  CheckedInput input;
  const auto check = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(input.scan, CheckScan(scan, options.check, context));
    return absl::OkStatus();
  };
  const auto hash = [&]() -> absl::Status {
    input.hash = HashOfScan(scan);
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, check, hash));
  return input;
}

absl::StatusOr<ScanSurface> Analyze(CheckedScan checked, const ReconstructOptions& options,
                                    const PipelineContext& context) {
  std::optional<StageScope> scope(std::in_place, Stage::kNeighbors, context);
  RILIEVO_ASSIGN_OR_RETURN(ScanNeighbors neighbors,
                           FindNeighbors(std::move(checked), options.scan, context));
  scope.emplace(Stage::kNormals, context);
  return OrientScan(std::move(neighbors), options.scan, context);
}

}  // namespace

absl::StatusOr<ShapedInput> ShapeScan(const PointCloud& scan, PointCloud* spent,
                                      const ReconstructOptions& options,
                                      const PipelineContext& context) {
  if (options.control.boundary == BoundaryRule::kExact) {
    return absl::InvalidArgumentError(
        "boundary: exact is for meshes; the border of a scan is nowhere exact");
  }
  RILIEVO_ASSIGN_OR_RETURN(CheckedInput input, CheckInput(scan, options, context));
  if (spent != nullptr) *spent = PointCloud();
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface surface, Analyze(std::move(input.scan), options, context));
  return ShapePoints(std::move(surface), std::move(input.hash), options, context);
}

absl::StatusOr<ScanSurface> AnalyzeInput(const PointCloud& scan, PointCloud* spent,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(CheckedInput input, CheckInput(scan, options, context));
  if (spent != nullptr) *spent = PointCloud();
  return Analyze(std::move(input.scan), options, context);
}

absl::StatusOr<ShapedInput> ShapePoints(ScanSurface surface, std::string hash,
                                        const ReconstructOptions& options,
                                        const PipelineContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ReconstructOptions fractions,
                           WithoutLengths(options, surface.frame.diagonal));
  const StageScope scope(Stage::kControlMesh, context);
  RILIEVO_ASSIGN_OR_RETURN(
      ControlMeshResult control,
      BuildControlMesh(std::move(surface.cloud), std::move(surface.graph), surface.index,
                       surface.frame, fractions.control, context));
  surface.cloud = std::move(control.cloud);
  return ShapedInput{std::move(surface), std::move(control), std::move(fractions), std::move(hash)};
}

absl::StatusOr<ScanSurface> PointsOfScan(const PointCloud& scan, const ReconstructOptions& options,
                                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(CheckedScan checked, CheckScan(scan, options.check, context));
  return AnalyzeScan(std::move(checked), options.scan, context);
}

}  // namespace rilievo
