#include "core/pipeline/reconstruct.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coarse_surface.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/color_surface.h"
#include "core/pipeline/finished_surface.h"
#include "core/pipeline/fit_domain.h"
#include "core/pipeline/option_lengths.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/report_warnings.h"
#include "core/pipeline/safely.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/search_control_faces.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/shape_input.h"
#include "core/pipeline/stage_scope.h"
#include "core/pipeline/surface_from_pages.h"
#include "core/pipeline/verify_pages.h"

namespace rilievo {

absl::Status ReconstructOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(check.Validate());
  RILIEVO_RETURN_IF_ERROR(scan.Validate());
  RILIEVO_RETURN_IF_ERROR(control.Validate());
  RILIEVO_RETURN_IF_ERROR(fit.Validate());
  RILIEVO_RETURN_IF_ERROR(displacement.Validate());
  RILIEVO_RETURN_IF_ERROR(encode.Validate());
  RILIEVO_RETURN_IF_ERROR(lengths.Validate(control, encode));
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

absl::Status PartSizes::Validate() const {
  for (const auto& [name, value] : {std::pair("coarse_points", coarse_points),
                                    {"part_points", part_points},
                                    {"block_vertices", block_vertices}}) {
    if (value >= kReconstruct.least_of_part && value <= kReconstruct.most_of_part) continue;
    return absl::InvalidArgumentError(absl::StrCat(name, " = ", value, " must lie in [",
                                                   kReconstruct.least_of_part, ", ",
                                                   kReconstruct.most_of_part, "]"));
  }
  return absl::OkStatus();
}

namespace {

using Clock = std::chrono::steady_clock;

// What is known of the surface before it is coded.
DssMetadata MetadataOf(std::string input_hash, Topology topology, const ReconstructOptions& options,
                       const PipelineContext& context,
                       const std::optional<PartSizes>& parts = std::nullopt) {
  DssMetadata metadata;
  metadata.generator = "rilievo " RILIEVO_VERSION;
  metadata.scan_points = context.points;
  metadata.topology = TopologyName(topology);
  metadata.input_hash = std::move(input_hash);
  metadata.options = OptionsText(options, context.seed, parts);
  metadata.place = options.place;
  return metadata;
}

ReconstructReport ReportOf(const ScanFigures& scan, const ControlMeshResult& control,
                           const FinishedSurface& finished, const ReconstructOptions& options) {
  const CodedSurface& coded = finished.coded;
  const CertifiedBytes& certified = finished.certified;
  const auto count = [&](HeightSource source) {
    return finished.source_counts[static_cast<size_t>(source)];
  };
  ReconstructReport report;
  report.place = options.place;
  report.points_in = coded.metadata.scan_points;
  report.non_finite = scan.non_finite;
  report.duplicates = scan.duplicates;
  report.strays = scan.strays;
  report.outliers = scan.outliers;
  report.island_points = scan.island_points;
  report.foliage_points = scan.foliage_points;
  report.points_used = scan.kept;
  report.normal_disagreement = scan.orientation.disagreement;
  report.stations = scan.orientation.stations;
  report.normals = scan.orientation.normals;
  report.topology = TopologyName(control.topology);
  report.topology_reason = control.reason;
  report.domain_rms = coded.domain.fit.rms_after;
  report.border_miss = coded.domain.border_miss;
  report.fit_rounds = coded.domain.fit.rounds;
  report.fit_converged = coded.domain.fit.converged;
  const DisplacedSurface& surface = coded.surface;
  const ControlMesh& mesh = surface.control_mesh;
  const TopologySummary topology =
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  report.components = static_cast<int>(topology.components);
  report.boundary_loops = static_cast<int>(topology.boundary_loops);
  report.close_asked = options.control.boundary == BoundaryRule::kClose;
  report.genus = static_cast<int>(topology.genus);
  report.diagonal = surface.frame.diagonal;
  report.control_vertices = static_cast<int>(mesh.vertices.cols());
  report.control_faces = static_cast<int>(mesh.faces.cols());
  report.max_level = surface.max_level;
  report.surface_faces = mesh.faces.cols() << (2 * surface.max_level);
  report.heights_measured = count(HeightSource::kMeasured);
  report.heights_smoothed = count(HeightSource::kSmoothed);
  report.heights_filled = count(HeightSource::kFilled);
  report.surface_vertices =
      report.heights_measured + report.heights_smoothed + report.heights_filled;
  const UncodedError& uncoded = coded.uncoded;
  report.median_spacing = uncoded.spacing;
  report.median_noise = uncoded.noise;
  report.error = certified.error;
  report.encoded_bytes = BytesOf(certified.encoded);
  report.color_bytes = finished.colors.bytes;
  report.color_rms = finished.colors.rms;
  if (options.encode.max_error) {
    report.max_error = *options.encode.max_error;
    if (options.measure) report.uncoded_error = uncoded.error.across_rms;
    const double reached = options.measure ? report.error.across_rms : OwnError(uncoded);
    report.error_unreachable = reached > report.max_error;
  }
  return report;
}

// `faces_given`: the number of control faces is the caller's. Points and mesh of `input` are spent.
absl::StatusOr<FinishedSurface> FinishInMemory(bool faces_given, const DssMetadata& metadata,
                                               const PipelineContext& context, ShapedInput* input) {
  ScanSurface scan = std::move(input->scan);
  const bool has_colors = !scan.colors.empty();
  const ReconstructOptions options =
      has_colors ? WithRoomForColors(input->options) : input->options;
  const std::vector<Rgb> colors = std::move(scan.colors);
  OrientedCloud cloud;
  CodedSurface coded;
  if (!faces_given && (options.encode.max_error || options.encode.max_bytes)) {
    RILIEVO_ASSIGN_OR_RETURN(coded, SearchControlFaces(scan, input->given_mesh, input->control,
                                                       metadata, options, context));
    cloud = CloudAlone(std::move(scan));
  } else {
    const ControlMesh& mesh = input->control.mesh;
    RILIEVO_ASSIGN_OR_RETURN(
        Domain domain, faces_given ? FitDomain(scan, mesh, options, context)
                                   : FitFewFaces(scan, scan.cloud.median_spacing, input->given_mesh,
                                                 mesh, options, context));
    RILIEVO_ASSIGN_OR_RETURN(
        SampledSurface sampled,
        SampleHeights(scan, input->control.topology, std::move(domain), options, context));
    cloud = CloudAlone(std::move(scan));
    RILIEVO_ASSIGN_OR_RETURN(coded, CodeSurface(cloud, input->given_mesh, std::move(sampled),
                                                metadata, options, context));
    RILIEVO_ASSIGN_OR_RETURN(
        coded, KeepError(cloud, input->given_mesh, std::move(coded), options, context));
  }
  CodedColors coded_colors;
  if (has_colors) {
    RILIEVO_ASSIGN_OR_RETURN(coded_colors,
                             ColorSurface(cloud, colors, input->options, context, &coded));
  }
  RILIEVO_ASSIGN_OR_RETURN(FinishedSurface finished,
                           FinishSurface(std::move(coded), std::move(cloud),
                                         std::move(input->given_mesh), options, context));
  finished.colors = coded_colors;
  return finished;
}

// The report is complete but for what depends on where the points lay.
absl::StatusOr<Reconstruction> Made(FinishedSurface finished, ReconstructReport report,
                                    const StageSeconds& seconds, Clock::time_point start) {
  std::copy(seconds.begin(), seconds.end(), report.stage_seconds);
  report.total_seconds = std::chrono::duration<double>(Clock::now() - start).count();
  report.warnings = WarningsOf(report);
  return Reconstruction{std::move(finished.coded.surface), std::move(finished.certified.encoded),
                        std::move(report)};
}

// `spent`: where the scan's memory may go once its points have been checked; or null.
absl::StatusOr<Reconstruction> RunStages(const PointCloud& scan, PointCloud* spent,
                                         const ReconstructOptions& given,
                                         const RunContext& caller) {
  const auto start = Clock::now();
  StageSeconds seconds{};
  const PipelineContext context{caller, &seconds, scan.points.cols()};
  const bool faces_given = given.control.target_faces > 0 || given.control.user_mesh;
  const auto shape = scan.triangles.cols() > 0 ? ShapeMesh : ShapeScan;
  RILIEVO_ASSIGN_OR_RETURN(ShapedInput input, shape(scan, spent, given, context));
  const ScanFigures figures = input.scan.figures;
  const bool has_colors = !input.scan.colors.empty();
  const DssMetadata metadata =
      MetadataOf(std::move(input.hash), input.control.topology, input.options, context);
  RILIEVO_ASSIGN_OR_RETURN(FinishedSurface finished,
                           FinishInMemory(faces_given, metadata, context, &input));
  ReconstructReport report = ReportOf(figures, input.control, finished, input.options);
  report.mesh = input.mesh;
  report.colors_left_out = has_colors && finished.colors.bytes == 0;
  return Made(std::move(finished), std::move(report), seconds, start);
}

absl::StatusOr<Reconstruction> RunPaged(const PagedScan& pages, const PartSizes& sizes,
                                        const ReconstructOptions& given, SharedParts* shared,
                                        const RunContext& caller) {
  const auto start = Clock::now();
  StageSeconds seconds{};
  const PipelineContext context{caller, &seconds, pages.size()};
  RILIEVO_ASSIGN_OR_RETURN(CoarseSurface coarse,
                           ShapeCoarsely(pages, sizes.coarse_points, given, shared, context));
  const ScanFigures figures = coarse.scan.figures;
  RILIEVO_ASSIGN_OR_RETURN(std::string hash, HashOfPages(pages, context));
  DssMetadata metadata =
      MetadataOf(std::move(hash), coarse.control.topology, coarse.options, context, sizes);
  metadata.scan_points = pages.figures().points_in;
  RILIEVO_ASSIGN_OR_RETURN(FinishedSurface finished,
                           FinishFromPages(pages, sizes, metadata, shared, context, &coarse));
  ReconstructReport report = ReportOf(figures, coarse.control, finished, coarse.options);
  report.non_finite = pages.figures().non_finite;
  report.duplicates = pages.figures().duplicates;
  report.strays = pages.figures().strays;
  report.points_used = finished.points_used;
  report.outliers = pages.size() - finished.points_used;
  report.island_points = report.foliage_points = 0;
  return Made(std::move(finished), std::move(report), seconds, start);
}

}  // namespace

absl::StatusOr<Reconstruction> Reconstruct(const PointCloud& scan,
                                           const ReconstructOptions& options,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  return Safely([&] { return RunStages(scan, nullptr, options, context); });
}

absl::StatusOr<Reconstruction> ReconstructAndDrop(PointCloud scan,
                                                  const ReconstructOptions& options,
                                                  const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  return Safely([&] { return RunStages(scan, &scan, options, context); });
}

absl::StatusOr<Reconstruction> ReconstructPaged(const PagedScan& scan, const PartSizes& sizes,
                                                const ReconstructOptions& options,
                                                const RunContext& context, SharedParts* shared) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(sizes.Validate());
  return Safely([&] { return RunPaged(scan, sizes, options, shared, context); });
}

absl::Status HelpWithParts(const PagedScan& scan, const PartSizes& sizes,
                           const ReconstructOptions& options, const RunContext& context,
                           SharedParts* shared) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(sizes.Validate());
  return Safely([&]() -> absl::Status {
    const PipelineContext of_run{context, nullptr, scan.size()};
    RILIEVO_ASSIGN_OR_RETURN(CoarseSurface coarse,
                             ShapeCoarsely(scan, sizes.coarse_points, options, shared, of_run));
    return HelpFromPages(scan, sizes, shared, of_run, &coarse);
  });
}

}  // namespace rilievo
