#include "core/pipeline/reconstruct.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/prepare_control_mesh.h"
#include "core/loop/refinement.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/report_warnings.h"

namespace rilievo {
namespace {

// Charges the time between its construction and destruction to one stage.
class StageTimer {
 public:
  StageTimer(Stage stage, const RunContext& context, ReconstructReport* report)
      : stage_(stage), context_(context), report_(report) {
    context_.Report(stage_, 0.0);
  }
  ~StageTimer() {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    report_->stage_seconds[static_cast<int>(stage_)] += elapsed.count();
    context_.Report(stage_, 1.0);
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Stage stage_;
  const RunContext& context_;
  ReconstructReport* report_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

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

absl::StatusOr<ScanSurface> Analyze(const CheckedScan& checked, const ReconstructOptions& options,
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
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface scan, AnalyzeScan(checked, options.scan, watched));
  report->outliers = scan.outliers;
  report->island_points = scan.island_points;
  report->points_used = scan.cloud.points.cols();
  report->diagonal = scan.frame.diagonal;
  report->median_spacing = scan.cloud.median_spacing;
  report->median_noise = scan.cloud.median_noise;
  report->normal_disagreement = scan.orientation.disagreement;
  return scan;
}

// The control mesh; the scan's normals take the sides that its road found.
absl::StatusOr<ControlMesh> Control(const ReconstructOptions& options, const RunContext& context,
                                    ScanSurface* cleaned, ReconstructReport* report) {
  ScanSurface& scan = *cleaned;
  const StageTimer timer(Stage::kControlMesh, context, report);
  ControlOptions control = options.control;
  if (control.user_mesh) {
    for (auto vertex : control.user_mesh->vertices.colwise()) {
      vertex = scan.frame.UnitFromScan(vertex);
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(ControlMeshResult result,
                           BuildControlMesh(scan.cloud, scan.graph, scan.index, control, context));
  report->road = TopologyName(result.road);
  report->road_reason = result.reason;
  report->components = result.components;
  report->boundary_loops = result.boundary_loops;
  report->genus = result.genus;
  report->control_vertices = static_cast<int>(result.mesh.vertices.cols());
  report->control_faces = static_cast<int>(result.mesh.faces.cols());
  if (result.normals.cols() > 0) scan.cloud.normals = std::move(result.normals);
  return std::move(result.mesh);
}

absl::StatusOr<ControlMesh> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                      const ReconstructOptions& options, const RunContext& context,
                                      ReconstructReport* report) {
  const StageTimer timer(Stage::kDomainFit, context, report);
  RILIEVO_ASSIGN_OR_RETURN(const DomainFit fit,
                           FitLoopDomain(scan.cloud, scan.index, start, options.fit, context));
  report->domain_rms = fit.rms_after;
  report->fit_rounds = fit.rounds;
  report->fit_converged = fit.converged;
  // Rounded before heights are sampled: the heights take up the rounding.
  return PrepareControlMesh(fit.control_mesh, options.encode.position_step);
}

absl::Status CheckSurfaceFaces(int64_t control_faces, int level, int64_t most) {
  if (control_faces <= most >> (2 * level)) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(control_faces, " control faces at level ", level,
                                                   " make more than max_surface_faces, ", most,
                                                   "; lower max_level or target_faces"));
}

// Displaced vertices as dense as the points: V_l is about control_faces / 2 * 4^l.
int ChooseLevel(const ReconstructOptions& options, int64_t points, int64_t control_faces) {
  if (options.max_level) return *options.max_level;
  const double steps = std::log2(2.0 * static_cast<double>(points) / control_faces) / 2;
  int level = std::clamp(static_cast<int>(std::lround(steps + 0.15)), 1, 6);
  while (level > 0 && control_faces > options.max_surface_faces >> (2 * level)) --level;
  return level;
}

struct Relief {
  DisplacedSurface surface;
  Shape shape;  // of the finest level, unit frame
};

absl::StatusOr<Relief> Displace(const ScanSurface& scan, const ControlMesh& control_mesh,
                                const ReconstructOptions& options, const RunContext& context,
                                ReconstructReport* report) {
  const StageTimer timer(Stage::kDisplacement, context, report);
  Relief relief;
  DisplacedSurface& surface = relief.surface;
  surface.frame = scan.frame;
  surface.control_mesh = control_mesh;
  surface.max_level = ChooseLevel(options, report->points_used, control_mesh.faces.cols());
  RILIEVO_RETURN_IF_ERROR(
      CheckSurfaceFaces(control_mesh.faces.cols(), surface.max_level, options.max_surface_faces));
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(control_mesh, surface.max_level, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LimitSurface limit,
      EvaluateLimit(refinement, control_mesh.vertices, surface.max_level, context));
  RILIEVO_ASSIGN_OR_RETURN(DisplacementField field,
                           SampleDisplacement(scan.cloud, scan.graph, scan.index, refinement, limit,
                                              options.displacement, context));
  relief.shape.vertices = limit.positions;
  for (int64_t v = 0; v < limit.positions.cols(); ++v) {
    relief.shape.vertices.col(v) += double{field.heights[v]} * limit.normals.col(v);
  }
  relief.shape.triangles = refinement.levels.back().faces;
  report->max_level = surface.max_level;
  report->surface_vertices = relief.shape.vertices.cols();
  report->surface_faces = relief.shape.triangles.cols();
  report->heights_measured = field.measured;
  report->heights_smoothed = field.smoothed;
  report->heights_filled = field.filled;
  surface.heights = std::move(field.heights);
  surface.sources = std::move(field.source);
  return relief;
}

// Points spread evenly over the scan, for they are in Morton order: enough for an RMS to 1 %.
Eigen::Matrix3Xd SomePoints(const Eigen::Matrix3Xd& points) {
  constexpr Eigen::Index kMost = 50000;
  const Eigen::Index stride = (points.cols() + kMost - 1) / kMost;
  Eigen::Matrix3Xd some(3, (points.cols() + stride - 1) / stride);
  for (Eigen::Index i = 0; i < some.cols(); ++i) some.col(i) = points.col(i * stride);
  return some;
}

// How far the points lie from the surface before it is coded: how exactly it is worth coding
// follows from that. The errors of the report are those of the coded surface (Certify).
absl::Status Measure(const ScanSurface& scan, const Shape& shape, const RunContext& context,
                     ReconstructReport* report) {
  const StageTimer timer(Stage::kMeasure, context, report);
  RILIEVO_ASSIGN_OR_RETURN(
      report->error.b_to_a,
      MeasureOneSided({SomePoints(scan.cloud.points), {}}, shape, {}, context));
  return absl::OkStatus();
}

// What is known of the surface before it is coded.
DssMetadata MetadataOf(const PointCloud& scan, const ReconstructOptions& options, uint64_t seed,
                       const ReconstructReport& report) {
  DssMetadata metadata;
  metadata.generator = "rilievo " RILIEVO_VERSION;
  metadata.scan_points = report.points_in;
  metadata.road = report.road;
  metadata.input_hash = HashOfScan(scan);
  metadata.options = OptionsText(options, seed);
  const double heights = static_cast<double>(report.heights_measured + report.heights_smoothed +
                                             report.heights_filled);
  metadata.smoothed_share = static_cast<double>(report.heights_smoothed) / heights;
  return metadata;
}

// With figures that take as many bytes as any, so that a size kept with them is kept with the true
// ones.
DssMetadata WithWidestFigures(DssMetadata metadata, bool measured, int64_t faces) {
  constexpr double kWide = 1.0 / 3;
  if (measured) {
    metadata.error_rms = metadata.error_mean = metadata.error_p95 = metadata.error_max = kWide;
    metadata.surface_to_scan = metadata.scan_to_surface = {kWide, kWide, kWide, kWide};
  }
  metadata.measured_share = metadata.smoothed_share = metadata.filled_share = kWide;
  metadata.folds = faces;
  return metadata;
}

absl::StatusOr<EncodedSurface> Encode(const DisplacedSurface& surface, const DssMetadata& metadata,
                                      const ReconstructOptions& options, const RunContext& context,
                                      ReconstructReport* report) {
  const StageTimer timer(Stage::kEncode, context, report);
  EncodeOptions encode = options.encode;
  if (encode.height_step == 0 && !encode.max_error && !encode.max_bytes) {
    encode.max_error = CodingError(*report, options.measure);
  } else if (encode.max_error) {
    encode.max_error = CodingErrorWithin(*encode.max_error, *report, options.measure);
    report->error_unreachable = OwnError(*report, options.measure) > *options.encode.max_error;
  }
  return EncodeDss(surface, WithWidestFigures(metadata, options.measure, report->surface_faces),
                   encode, context);
}

// Decodes the bytes that go out, and writes into them what they are worth.
absl::Status Certify(const ScanSurface& scan, DssMetadata metadata,
                     const ReconstructOptions& options, const RunContext& context,
                     EncodedSurface* encoded, ReconstructReport* report) {
  RunContext silent = context;  // progress has passed this stage
  silent.progress = nullptr;
  const StageTimer timer(Stage::kMeasure, silent, report);
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(encoded->Concatenate(), silent));
  RILIEVO_ASSIGN_OR_RETURN(
      report->error, CertifySurface(decoded.surface, options.measure ? &scan.cloud.points : nullptr,
                                    silent, &metadata));
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

absl::StatusOr<Reconstruction> RunStages(const PointCloud& scan, const ReconstructOptions& options,
                                         const RunContext& context) {
  const auto start = std::chrono::steady_clock::now();
  Reconstruction result;
  ReconstructReport* report = &result.report;

  RILIEVO_ASSIGN_OR_RETURN(const CheckedScan checked, Check(scan, options, context, report));
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface cleaned, Analyze(checked, options, context, report));
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh coarse, Control(options, context, &cleaned, report));
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh domain,
                           FitDomain(cleaned, coarse, options, context, report));
  RILIEVO_ASSIGN_OR_RETURN(Relief relief, Displace(cleaned, domain, options, context, report));
  if (options.measure) {
    RILIEVO_RETURN_IF_ERROR(Measure(cleaned, relief.shape, context, report));
  }
  const DssMetadata metadata = MetadataOf(scan, options, context.seed, *report);
  RILIEVO_ASSIGN_OR_RETURN(result.encoded,
                           Encode(relief.surface, metadata, options, context, report));
  RILIEVO_RETURN_IF_ERROR(Certify(cleaned, metadata, options, context, &result.encoded, report));
  result.surface = std::move(relief.surface);

  report->total_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report->warnings = WarningsOf(*report);
  return result;
}

}  // namespace

absl::StatusOr<Reconstruction> Reconstruct(const PointCloud& scan,
                                           const ReconstructOptions& options,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  try {
    return RunStages(scan, options, context);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the memory does not suffice for this scan");
  } catch (const std::exception& defect) {
    return absl::InternalError(absl::StrCat("a library threw: ", defect.what()));
  }
}

}  // namespace rilievo
