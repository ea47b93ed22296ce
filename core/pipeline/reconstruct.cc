#include "core/pipeline/reconstruct.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <new>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/code_stored_surface.h"
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
#include "core/surface/stored_surface.h"

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

// Heights of thinned points tell how far the surface reaches, no more: one level less than they
// would allow.
ReconstructOptions AtCoarseLevel(ReconstructOptions options, const OrientedCloud& thinned,
                                 int64_t control_faces) {
  constexpr double kPointsPerVertex = 4;
  const auto points = static_cast<double>(thinned.points.cols());
  options.max_level = LevelAsDenseAs(points / kPointsPerVertex, control_faces);
  return options;
}

void TakeCounts(const std::array<int64_t, 3>& source_counts, ReconstructReport* report) {
  const auto count = [&](HeightSource source) {
    return source_counts[static_cast<size_t>(source)];
  };
  report->heights_measured = count(HeightSource::kMeasured);
  report->heights_smoothed = count(HeightSource::kSmoothed);
  report->heights_filled = count(HeightSource::kFilled);
  report->surface_vertices =
      report->heights_measured + report->heights_smoothed + report->heights_filled;
}

// A surface of pages that was coded in blocks.
struct FinishedInBlocks {
  CertifiedBytes certified;
  std::array<int64_t, 3> source_counts;
};

// Measures the heights in `sampled`, those of the thinned points, anew from all points. Unset where
// they and their triangles are in `sampled` then, to be coded as usual. Else the surface is
// finished, `coded` has the rest but heights, and the points of `oriented` are spent.
absl::StatusOr<std::optional<FinishedInBlocks>> FromPages(
    const Input& in, const DssMetadata& metadata, const ReconstructOptions& options,
    const PipelineContext& context, ScanSurface* oriented, SampledSurface* sampled,
    CodedSurface* coded) {
  DisplacedSurface& surface = sampled->surface;
  sampled->shape = Shape();
  StoredSurface stored;
  stored.frame = surface.frame;
  stored.control_mesh = surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(stored.max_level, LevelFor(options, in.pages->size(), oriented->cloud,
                                                      stored.control_mesh.faces.cols()));
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(stored.control_mesh));
  RILIEVO_ASSIGN_OR_RETURN(
      const ScratchHeights heights,
      MeasureHeightsFromPages(*in.pages, *oriented, surface, cutter, stored.max_level,
                              in.sizes.part_points, options, context));
  stored.heights = &heights;
  stored.source_counts = heights.source_counts();
  surface.max_level = stored.max_level;
  surface.heights = {};
  surface.sources = {};
  const std::optional<int> group =
      GroupFacesFor(stored, cutter, in.sizes.block_vertices, options.encode);
  if (!group) {
    std::vector<int> faces(static_cast<size_t>(stored.control_mesh.faces.cols()));
    std::iota(faces.begin(), faces.end(), 0);
    RILIEVO_RETURN_IF_ERROR(heights.Read(faces, FaceVertices(cutter.topology(), stored.max_level),
                                         &surface.heights, &surface.sources));
    RILIEVO_ASSIGN_OR_RETURN(sampled->shape, FinestTriangles(surface, context));
    return std::nullopt;
  }
  ReconstructOptions grouped = options;
  grouped.encode.group_faces = *group;
  RILIEVO_ASSIGN_OR_RETURN(CodedStoredSurface finished,
                           CodeStoredSurface(stored, cutter, CloudAlone(std::move(*oriented)),
                                             sampled->domain.position_step, metadata,
                                             in.sizes.block_vertices, grouped, context));
  coded->domain = std::move(sampled->domain);
  coded->surface = std::move(surface);
  coded->metadata = std::move(finished.metadata);
  coded->uncoded = finished.uncoded;
  return FinishedInBlocks{{std::move(finished.encoded), finished.error}, stored.source_counts};
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
  std::optional<FinishedInBlocks> in_blocks;
  if (!faces_given && in.pages == nullptr &&
      (options.encode.max_error || options.encode.max_bytes)) {
    RILIEVO_ASSIGN_OR_RETURN(
        coded, SearchControlFaces(oriented, input.given_mesh, control, metadata, options, context));
    cloud = CloudAlone(std::move(oriented));
  } else {
    const auto fit = faces_given ? FitDomain : FitUnderNoise;
    RILIEVO_ASSIGN_OR_RETURN(Domain domain, fit(oriented, control.mesh, options, context));
    const ReconstructOptions sampling =
        in.pages == nullptr
            ? options
            : AtCoarseLevel(options, oriented.cloud, domain.fit.control_mesh.faces.cols());
    RILIEVO_ASSIGN_OR_RETURN(
        SampledSurface sampled,
        SampleHeights(oriented, control.topology, std::move(domain), sampling, context));
    if (in.pages != nullptr) {
      RILIEVO_ASSIGN_OR_RETURN(
          in_blocks, FromPages(in, metadata, options, context, &oriented, &sampled, &coded));
    }
    cloud = CloudAlone(std::move(oriented));
    if (!in_blocks) {
      RILIEVO_ASSIGN_OR_RETURN(coded, CodeSurface(cloud, input.given_mesh, std::move(sampled),
                                                  metadata, options, context));
      RILIEVO_ASSIGN_OR_RETURN(
          coded, KeepError(cloud, input.given_mesh, std::move(coded), options, context));
    }
  }
  CodedColors coded_colors;
  if (!colors.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(coded_colors,
                             ColorSurface(cloud, colors, all_options, context, &coded));
  }
  std::optional<Shape> points;
  if (options.measure && !in_blocks) {
    const bool is_mesh = input.given_mesh.triangles.cols() > 0;
    points = is_mesh ? std::move(input.given_mesh) : PointsToMeasure(std::move(cloud));
  }
  CertifiedBytes certified;
  if (in_blocks) {
    certified = std::move(in_blocks->certified);
  } else {
    RILIEVO_ASSIGN_OR_RETURN(
        certified, Certify(std::move(coded.encoded), coded.metadata, std::move(points), context));
  }

  ReconstructReport report = ReportOf(figures, control, coded, certified, options);
  report.mesh = input.mesh;
  if (in.pages != nullptr) {
    const PagingFigures& paged = in.pages->figures();
    report.non_finite = paged.non_finite;
    report.duplicates = paged.duplicates;
    report.strays = paged.strays;
    report.points_used = in.pages->size();
  }
  if (in_blocks) TakeCounts(in_blocks->source_counts, &report);
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
