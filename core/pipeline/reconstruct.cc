#include "core/pipeline/reconstruct.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/color_surface.h"
#include "core/pipeline/fit_domain.h"
#include "core/pipeline/heights_from_pages.h"
#include "core/pipeline/option_lengths.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/report_warnings.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/search_control_faces.h"
#include "core/pipeline/shape_input.h"
#include "core/pipeline/stage_scope.h"

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

namespace {

// What is known of the surface before it is coded.
DssMetadata MetadataOf(std::string input_hash, Topology topology, const ReconstructOptions& options,
                       const PipelineContext& context) {
  DssMetadata metadata;
  metadata.generator = "rilievo " RILIEVO_VERSION;
  metadata.scan_points = context.points;
  metadata.topology = TopologyName(topology);
  metadata.input_hash = std::move(input_hash);
  metadata.options = OptionsText(options, context.seed);
  metadata.place = options.place;
  return metadata;
}

// The number of control faces is the caller's.
bool AreFacesGiven(const ReconstructOptions& options) {
  return options.control.target_faces > 0 || options.control.user_mesh;
}

// What is measured of a scan once its heights are there; the rest of its memory goes.
OrientedCloud CloudAlone(ScanSurface scan) { return std::move(scan.cloud); }

ReconstructReport ReportOf(const ScanFigures& scan, const ControlMeshResult& control,
                           const CodedSurface& coded, const CertifiedBytes& certified,
                           const ReconstructOptions& options) {
  ReconstructReport report;
  report.place = options.place;
  report.points_in = coded.metadata.scan_points;
  report.non_finite = scan.non_finite;
  report.duplicates = scan.duplicates;
  report.strays = scan.strays;
  report.outliers = scan.outliers;
  report.island_points = scan.island_points;
  report.points_used = scan.kept;
  report.normal_disagreement = scan.orientation.disagreement;
  report.stations = scan.orientation.stations;
  report.normals = scan.orientation.normals;
  report.topology = TopologyName(control.topology);
  report.topology_reason = control.reason;
  report.domain_rms = coded.domain.fit.rms_after;
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
  report.surface_vertices = static_cast<int64_t>(surface.heights.size());
  report.surface_faces = mesh.faces.cols() << (2 * surface.max_level);
  report.heights_measured = CountOf(HeightSource::kMeasured, surface);
  report.heights_smoothed = CountOf(HeightSource::kSmoothed, surface);
  report.heights_filled = CountOf(HeightSource::kFilled, surface);
  const UncodedError& uncoded = coded.uncoded;
  report.median_spacing = uncoded.spacing;
  report.median_noise = uncoded.noise;
  report.error = certified.error;
  report.encoded_bytes = BytesOf(certified.encoded);
  if (options.encode.max_error) {
    report.max_error = *options.encode.max_error;
    if (options.measure) report.uncoded_error = uncoded.error.across_rms;
    const double reached = options.measure ? report.error.across_rms : OwnError(uncoded);
    report.error_unreachable = reached > report.max_error;
  }
  return report;
}

// What goes in besides the points in memory.
struct Input {
  PointCloud* spent = nullptr;  // where the scan's memory may go once its points have been checked
  const PagedScan* pages = nullptr;  // of a thinned scan: all its points
  PartSizes sizes = {};
};

// More faces than a scan in memory gets, where its points ask for them and the thinned ones can
// carry them.
ReconstructOptions WithFacesForPages(ReconstructOptions options, const PagedScan& pages,
                                     int64_t thinned) {
  constexpr int64_t kFacesInMemory = 12000;  // at most
  constexpr int64_t kPointsPerFace = 120, kThinnedPerFace = 30;
  const int64_t faces = std::min(pages.size() / kPointsPerFace, thinned / kThinnedPerFace);
  if (!AreFacesGiven(options) && faces > kFacesInMemory) {
    options.control.target_faces = static_cast<int>(faces);
  }
  return options;
}

// The level asked for is that of all points, not of thinned ones.
ReconstructOptions WithoutLevel(ReconstructOptions options) {
  options.max_level.reset();
  return options;
}

absl::StatusOr<Reconstruction> RunStages(const PointCloud& scan, const Input& in,
                                         const ReconstructOptions& given,
                                         const RunContext& caller) {
  const auto start = std::chrono::steady_clock::now();
  StageSeconds seconds{};
  const PipelineContext context{caller, &seconds, scan.points.cols()};
  const bool faces_given = AreFacesGiven(given);
  const ReconstructOptions asked =
      in.pages != nullptr ? WithFacesForPages(given, *in.pages, scan.points.cols()) : given;

  const auto shape = scan.triangles.cols() > 0 ? ShapeMesh : ShapeScan;
  RILIEVO_ASSIGN_OR_RETURN(ShapedInput input, shape(scan, in.spent, asked, context));
  const ReconstructOptions& all_options = input.options;
  const std::vector<Rgb> colors = std::move(input.scan.colors);
  const ReconstructOptions options = colors.empty() ? all_options : WithRoomForColors(all_options);
  ScanSurface& oriented = input.scan;
  const ControlMeshResult& control = input.control;
  const ScanFigures figures = oriented.figures;
  DssMetadata metadata = MetadataOf(std::move(input.hash), control.topology, all_options, context);
  if (in.pages != nullptr) {
    metadata.input_hash.clear();
    metadata.scan_points = in.pages->figures().points_in;
  }
  OrientedCloud cloud;
  CodedSurface coded;
  if (!faces_given && in.pages == nullptr &&
      (options.encode.max_error || options.encode.max_bytes)) {
    RILIEVO_ASSIGN_OR_RETURN(
        coded, SearchControlFaces(oriented, input.given_mesh, control, metadata, options, context));
    cloud = CloudAlone(std::move(oriented));
  } else {
    const auto fit = faces_given ? FitDomain : FitUnderNoise;
    RILIEVO_ASSIGN_OR_RETURN(Domain domain, fit(oriented, control.mesh, options, context));
    RILIEVO_ASSIGN_OR_RETURN(
        SampledSurface sampled,
        SampleHeights(oriented, control.topology, std::move(domain),
                      in.pages == nullptr ? options : WithoutLevel(options), context));
    if (in.pages != nullptr) {
      RILIEVO_RETURN_IF_ERROR(MeasureHeightsFromPages(*in.pages, oriented, in.sizes.part_points,
                                                      options, context, &sampled));
    }
    cloud = CloudAlone(std::move(oriented));
    RILIEVO_ASSIGN_OR_RETURN(coded, CodeSurface(cloud, input.given_mesh, std::move(sampled),
                                                metadata, options, context));
    RILIEVO_ASSIGN_OR_RETURN(
        coded, KeepError(cloud, input.given_mesh, std::move(coded), options, context));
  }
  CodedColors coded_colors;
  if (!colors.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(coded_colors,
                             ColorSurface(cloud, colors, all_options, context, &coded));
  }
  std::optional<Shape> points;
  if (options.measure) {
    const bool is_mesh = input.given_mesh.triangles.cols() > 0;
    points = is_mesh ? std::move(input.given_mesh) : PointsToMeasure(std::move(cloud));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      CertifiedBytes certified,
      Certify(std::move(coded.encoded), coded.metadata, std::move(points), context));

  ReconstructReport report = ReportOf(figures, control, coded, certified, options);
  report.mesh = input.mesh;
  if (in.pages != nullptr) {
    const PagingFigures& paged = in.pages->figures();
    report.non_finite = paged.non_finite;
    report.duplicates = paged.duplicates;
    report.strays = paged.strays;
    report.points_used = in.pages->size();
  }
  report.color_bytes = coded_colors.bytes;
  report.color_rms = coded_colors.rms;
  report.colors_left_out = !colors.empty() && coded_colors.bytes == 0;
  std::copy(seconds.begin(), seconds.end(), report.stage_seconds);
  report.total_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.warnings = WarningsOf(report);
  return Reconstruction{std::move(coded.surface), std::move(certified.encoded), std::move(report)};
}

// What `work` makes of options in range; exceptions become statuses.
template <typename Work>
absl::StatusOr<Reconstruction> Safely(const ReconstructOptions& options, const Work& work) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  try {
    return work();
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
  return Safely(options, [&] { return RunStages(scan, {}, options, context); });
}

absl::StatusOr<Reconstruction> ReconstructAndDrop(PointCloud scan,
                                                  const ReconstructOptions& options,
                                                  const RunContext& context) {
  return Safely(options, [&] { return RunStages(scan, {&scan}, options, context); });
}

absl::StatusOr<Reconstruction> ReconstructPaged(const PagedScan& scan, const PartSizes& sizes,
                                                const ReconstructOptions& options,
                                                const RunContext& context) {
  return Safely(options, [&]() -> absl::StatusOr<Reconstruction> {
    PointCloud thinned;
    RILIEVO_ASSIGN_OR_RETURN(thinned.points, scan.Thinned(sizes.coarse_points, context));
    return RunStages(thinned, {&thinned, &scan, sizes}, options, context);
  });
}

}  // namespace rilievo
