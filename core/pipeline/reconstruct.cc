#include "core/pipeline/reconstruct.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/pipeline/build_surface.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"
#include "core/pipeline/domain_resolution.h"
#include "core/pipeline/keep_error.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/report_warnings.h"
#include "core/pipeline/search_control_faces.h"
#include "core/pipeline/stage_timer.h"

namespace rilievo {
namespace {

absl::StatusOr<CheckedScan> Check(const PointCloud& scan, const ReconstructOptions& options,
                                  const RunContext& context, ReconstructReport* report) {
  const StageTimer timer(Stage::kCheck, context, report);
  RILIEVO_ASSIGN_OR_RETURN(CheckedScan checked, CheckScan(scan, options.check, context));
  report->points_in = scan.points.cols();
  report->non_finite = checked.non_finite;
  report->duplicates = checked.duplicates;
  report->strays = checked.strays;
  return checked;
}

absl::StatusOr<ScanSurface> Analyze(CheckedScan checked, const ReconstructOptions& options,
                                    const RunContext& context, ReconstructReport* report) {
  // One call for two stages: the clock passes from neighbours to normals at the first word of them.
  std::optional<StageTimer> timer(std::in_place, Stage::kNeighbors, context, report);
  bool at_normals = false;
  RunContext watched = context;
  watched.progress = [&](const Progress& progress) {
    if (progress.stage == Stage::kNormals && !at_normals) {
      at_normals = true;
      timer.emplace(Stage::kNormals, context, report);
    }
    context.Report(progress.stage, progress.fraction);
  };
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface scan,
                           AnalyzeScan(std::move(checked), options.scan, watched));
  report->outliers = scan.outliers;
  report->island_points = scan.island_points;
  report->points_used = scan.cloud.points.cols();
  report->diagonal = scan.frame.diagonal;
  report->median_spacing = scan.cloud.median_spacing;
  report->median_noise = scan.cloud.median_noise;
  report->normal_disagreement = scan.orientation.disagreement;
  return scan;
}

// The control mesh. Flips those of the scan's normals that disagree with its implicit function.
absl::StatusOr<ControlMesh> Control(const ReconstructOptions& options, const RunContext& context,
                                    ScanSurface* cleaned, ReconstructReport* report) {
  ScanSurface& scan = *cleaned;
  const StageTimer timer(Stage::kControlMesh, context, report);
  RILIEVO_ASSIGN_OR_RETURN(ControlMeshResult result,
                           BuildControlMesh(std::move(scan.cloud), scan.graph, scan.index,
                                            scan.frame, options.control, context));
  scan.cloud = std::move(result.cloud);
  report->topology = TopologyName(result.topology);
  report->topology_reason = result.reason;
  report->components = result.components;
  report->boundary_loops = result.boundary_loops;
  report->genus = result.genus;
  report->control_vertices = static_cast<int>(result.mesh.vertices.cols());
  report->control_faces = static_cast<int>(result.mesh.faces.cols());
  return std::move(result.mesh);
}

// What is known of the surface before it is coded.
DssMetadata MetadataOf(std::string input_hash, const ReconstructOptions& options, uint64_t seed,
                       const ReconstructReport& report) {
  DssMetadata metadata;
  metadata.generator = "rilievo " RILIEVO_VERSION;
  metadata.scan_points = report.points_in;
  metadata.topology = report.topology;
  metadata.input_hash = std::move(input_hash);
  metadata.options = OptionsText(options, seed);
  return metadata;
}

// What is left of a scan when its surface is made; the rest of its memory goes.
Shape PointsAlone(ScanSurface scan) { return PointsToMeasure(std::move(scan.cloud)); }

absl::StatusOr<SearchableShape> MakeSearchable(Shape points,
                                               std::optional<ClosestPointTree> points_tree,
                                               const RunContext& context) {
  if (!points_tree) return MakeSearchable(std::move(points), context);
  return SearchableShape{std::move(points), *std::move(points_tree)};
}

// Decodes the bytes that go out, and writes into them what they are worth.
absl::Status Certify(Shape points, const ReconstructOptions& options, const RunContext& context,
                     CodedSurface* coded, ReconstructReport* report) {
  RunContext silent = context;  // progress has passed this stage
  silent.progress = nullptr;
  const StageTimer timer(Stage::kMeasure, silent, report);
  EncodedSurface* encoded = &coded->encoded;
  DssMetadata metadata = coded->metadata;
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(encoded->Concatenate(), silent));
  std::optional<SearchableShape> to_measure;
  if (options.measure) {
    RILIEVO_ASSIGN_OR_RETURN(
        to_measure, MakeSearchable(std::move(points), std::move(coded->points_tree), silent));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      report->error,
      CertifySurface(decoded.surface, to_measure ? &*to_measure : nullptr, silent, &metadata));
  report->max_error = options.encode.max_error.value_or(0);
  const double reached =
      options.measure ? report->error.across_rms : OwnError(*report, options.measure);
  report->error_unreachable = report->max_error > 0 && reached > report->max_error;
  RILIEVO_RETURN_IF_ERROR(ReplaceMetadata(metadata, *encoded));
  for (const auto& chunk : encoded->chunks) report->encoded_bytes += chunk.size();
  return absl::OkStatus();
}

}  // namespace

absl::Status ReconstructOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(check.Validate());
  RILIEVO_RETURN_IF_ERROR(scan.Validate());
  RILIEVO_RETURN_IF_ERROR(control.Validate());
  RILIEVO_RETURN_IF_ERROR(fit.Validate());
  RILIEVO_RETURN_IF_ERROR(displacement.Validate());
  RILIEVO_RETURN_IF_ERROR(encode.Validate());
  if (max_surface_faces < 1 || max_surface_faces > int64_t{1} << 30) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_surface_faces = ", max_surface_faces, " must lie in [1, 2^30]"));
  }
  if (max_level && (*max_level < 0 || *max_level > kMaxLoopLevel)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level = ", *max_level, " must lie in [0, ", kMaxLoopLevel, "]"));
  }
  return absl::OkStatus();
}

namespace {

// The number of control faces is the caller's, or the one that serves best. Leaves of the scan what
// its measurement asks for.
absl::StatusOr<CodedSurface> BuildAsAsked(const ControlMesh& start, const DssMetadata& metadata,
                                          const ReconstructOptions& options,
                                          const RunContext& context, ScanSurface* cleaned,
                                          ReconstructReport* report) {
  const ScanSurface& scan = *cleaned;
  const bool given = options.control.target_faces > 0 || options.control.user_mesh;
  if (!given && (options.encode.max_error || options.encode.max_bytes)) {
    return SearchControlFaces(scan, start, metadata, options, context, report);
  }
  const auto fit = given ? FitDomain : FitUnderNoise;
  RILIEVO_ASSIGN_OR_RETURN(Domain domain, fit(scan, start, options, context, report));
  ReleaseToOsAfter(scan.cloud.points.cols());
  RILIEVO_ASSIGN_OR_RETURN(UncodedSurface sampled,
                           SampleSurfaceHeights(scan, std::move(domain), options, context, report));
  cleaned->graph = NeighborGraph();
  { const PointIndex done = std::move(cleaned->index); }
  cleaned->cloud.noise = std::vector<float>();
  cleaned->cloud.ambiguous = std::vector<uint8_t>();
  ReleaseToOsAfter(scan.cloud.points.cols());
  const bool with_tree = options.measure;
  RILIEVO_ASSIGN_OR_RETURN(CodedSurface coded, CodeSurface(scan.cloud, std::move(sampled), metadata,
                                                           options, context, report, with_tree));
  RILIEVO_RETURN_IF_ERROR(KeepError(scan.cloud, options, context, report, &coded).status());
  return coded;
}

// `spent`: the scan, where its memory may go once its points have been checked; or null.
absl::StatusOr<Reconstruction> RunStages(const PointCloud& scan, PointCloud* spent,
                                         const ReconstructOptions& options,
                                         const RunContext& context) {
  const auto start = std::chrono::steady_clock::now();
  Reconstruction result;
  ReconstructReport* report = &result.report;

  // The check keeps one thread busy.
  CheckedScan checked;
  std::string input_hash;
  const auto check = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(checked, Check(scan, options, context, report));
    return absl::OkStatus();
  };
  const auto hash = [&]() -> absl::Status {
    input_hash = HashOfScan(scan);
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, check, hash));
  const int64_t point_count = checked.points.cols();
  if (spent != nullptr) *spent = PointCloud();
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface cleaned,
                           Analyze(std::move(checked), options, context, report));
  ReleaseToOsAfter(point_count);
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh coarse, Control(options, context, &cleaned, report));
  ReleaseToOsAfter(point_count);
  const DssMetadata metadata = MetadataOf(std::move(input_hash), options, context.seed, *report);
  RILIEVO_ASSIGN_OR_RETURN(CodedSurface coded,
                           BuildAsAsked(coarse, metadata, options, context, &cleaned, report));
  Shape points = PointsAlone(std::move(cleaned));
  ReleaseToOsAfter(point_count);
  RILIEVO_RETURN_IF_ERROR(Certify(std::move(points), options, context, &coded, report));
  result.encoded = std::move(coded.encoded);
  result.surface = std::move(coded.surface);

  report->total_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report->warnings = WarningsOf(*report);
  return result;
}

// Exceptions become statuses.
absl::StatusOr<Reconstruction> RunSafely(const PointCloud& scan, PointCloud* spent,
                                         const ReconstructOptions& options,
                                         const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  try {
    return RunStages(scan, spent, options, context);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the memory does not suffice for this scan");
  } catch (const std::exception& defect) {
    return absl::InternalError(absl::StrCat("a library threw: ", defect.what()));
  }
}

}  // namespace

absl::StatusOr<Reconstruction> Reconstruct(const PointCloud& scan,
                                           const ReconstructOptions& options,
                                           const RunContext& context) {
  return RunSafely(scan, nullptr, options, context);
}

absl::StatusOr<Reconstruction> ReconstructAndDrop(PointCloud scan,
                                                  const ReconstructOptions& options,
                                                  const RunContext& context) {
  return RunSafely(scan, &scan, options, context);
}

}  // namespace rilievo
