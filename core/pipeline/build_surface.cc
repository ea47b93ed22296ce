#include "core/pipeline/build_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/control/topology/trim_unmeasured.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"
#include "core/pipeline/position_step.h"
#include "core/pipeline/stage_timer.h"

namespace rilievo {
namespace {

absl::Status CheckSurfaceFaces(int64_t control_faces, int level, int64_t most) {
  if (control_faces <= most >> (2 * level)) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(control_faces, " control faces at level ", level,
                                                   " make more than max_surface_faces, ", most,
                                                   "; lower max_level or target_faces"));
}

// Points whose noise is more than 0.4 of their spacing are worth fewer: what they show together is
// smoother.
int ChooseLevel(const ReconstructOptions& options, const OrientedCloud& cloud,
                int64_t control_faces) {
  if (options.max_level) return *options.max_level;
  constexpr double kNoises = 2.5;
  const double blur = std::max(1.0, kNoises * cloud.median_noise / cloud.median_spacing);
  const double points = static_cast<double>(cloud.points.cols()) / (blur * blur);
  int level = LevelAsDenseAs(points, control_faces);
  while (level > 0 && control_faces > options.max_surface_faces >> (2 * level)) --level;
  return level;
}

// All levels, of the finest, unless it is the control mesh, the vertices alone: heights ask for no
// more, and its faces follow from the level before.
absl::StatusOr<LoopRefinement> RefineToVertices(const ControlMesh& mesh, int level,
                                                const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(LoopRefinement refinement,
                           RefineTopology(mesh, std::max(0, level - 1), context));
  if (level > 0) refinement.levels.push_back(VerticesAfter(refinement.levels.back()));
  return refinement;
}

absl::StatusOr<UncodedSurface> Displace(const ScanSurface& scan, const ControlMesh& control_mesh,
                                        const ReconstructOptions& options,
                                        const RunContext& context, ReconstructReport* report) {
  const StageTimer timer(Stage::kDisplacement, context, report);
  UncodedSurface uncoded;
  DisplacedSurface& surface = uncoded.surface;
  surface.frame = scan.frame;
  surface.control_mesh = control_mesh;
  surface.max_level = ChooseLevel(options, scan.cloud, control_mesh.faces.cols());
  RILIEVO_RETURN_IF_ERROR(
      CheckSurfaceFaces(control_mesh.faces.cols(), surface.max_level, options.max_surface_faces));
  const int level = surface.max_level;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(control_mesh, level, context));
  const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
  const LevelRings rings =
      level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
  RILIEVO_ASSIGN_OR_RETURN(LimitSurface limit, EvaluateLimit(refinement, control_mesh.vertices,
                                                             surface.max_level, context));
  RILIEVO_ASSIGN_OR_RETURN(DisplacementField field,
                           SampleDisplacement(scan.cloud, scan.graph, scan.index, refinement, rings,
                                              limit, options.displacement, context));
  uncoded.shape.vertices = std::move(limit.positions);
  for (int64_t v = 0; v < limit.normals.cols(); ++v) {
    uncoded.shape.vertices.col(v) += double{field.heights[v]} * limit.normals.col(v);
  }
  uncoded.shape.triangles = FinestFaces(refinement);
  uncoded.shape.children_per_face = 1 << (2 * level);
  report->max_level = surface.max_level;
  report->surface_vertices = uncoded.shape.vertices.cols();
  report->surface_faces = uncoded.shape.triangles.cols();
  report->heights_measured = field.measured;
  report->heights_smoothed = field.smoothed;
  report->heights_filled = field.filled;
  surface.heights = std::move(field.heights);
  surface.sources = std::move(field.source);
  return uncoded;
}

// Per control face, the share of its heights that had no data.
std::vector<float> UnmeasuredShares(const UncodedSurface& uncoded) {
  const DisplacedSurface& surface = uncoded.surface;
  std::vector<float> shares(surface.control_mesh.faces.cols(), 0.0f);
  const float corner_share = 1.0f / static_cast<float>(int64_t{3} << (2 * surface.max_level));
  for (int64_t f = 0; f < uncoded.shape.triangles.cols(); ++f) {
    for (const int v : uncoded.shape.triangles.col(f)) {
      if (surface.sources[v] == HeightSource::kFilled) {
        shares[f >> (2 * surface.max_level)] += corner_share;
      }
    }
  }
  return shares;
}

void ReportTopology(const ControlMesh& mesh, ReconstructReport* report) {
  const TopologySummary topology =
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  report->components = static_cast<int>(topology.components);
  report->boundary_loops = static_cast<int>(topology.boundary_loops);
  report->genus = static_cast<int>(topology.genus);
}

// Where the scan turns out to have an opening the domain is cut, and fitted and sampled once more.
// The other topologies than kArbitrary know their borders beforehand.
absl::StatusOr<UncodedSurface> DisplaceAndCut(const ScanSurface& scan, Domain* domain,
                                              const ReconstructOptions& options,
                                              const RunContext& context,
                                              ReconstructReport* report) {
  RILIEVO_ASSIGN_OR_RETURN(UncodedSurface uncoded,
                           Displace(scan, domain->mesh, options, context, report));
  if (options.control.boundary == BoundaryRule::kClose ||
      report->topology != TopologyName(Topology::kArbitrary)) {
    return uncoded;
  }
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh cut,
                           TrimUnmeasured(domain->mesh, UnmeasuredShares(uncoded), scan.cloud,
                                          scan.index, TrimUnmeasuredOptions{}, context));
  if (cut.faces.cols() == domain->mesh.faces.cols()) return uncoded;
  uncoded = UncodedSurface();
  ReportTopology(cut, report);
  RILIEVO_ASSIGN_OR_RETURN(*domain, FitDomain(scan, cut, options, context, report));
  return Displace(scan, domain->mesh, options, context, report);
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
// follows from that. `to_keep`: as the certificate will say it. The errors of the report are those
// of the coded surface in the end (Certify).
absl::Status Measure(const OrientedCloud& cloud, const Shape& shape, bool to_keep,
                     const RunContext& context, ReconstructReport* report) {
  const StageTimer timer(Stage::kMeasure, context, report);
  if (to_keep) {
    RILIEVO_ASSIGN_OR_RETURN(report->error,
                             MeasureTriangles(shape, PointsToMeasure(cloud), context));
    report->uncoded_error = report->error.across_rms;
    return absl::OkStatus();
  }
  RILIEVO_ASSIGN_OR_RETURN(report->error.b_to_a,
                           MeasureOneSided({SomePoints(cloud.points), {}}, shape, {}, context));
  return absl::OkStatus();
}

// With figures that take as many bytes as any, so that a size kept with them is kept with the true
// ones.
DssMetadata WithWidestFigures(DssMetadata metadata, bool measured, int64_t faces) {
  constexpr double kWide = 1.0 / 3;
  if (measured) {
    metadata.error_rms = metadata.error_mean = metadata.error_p95 = metadata.error_max = kWide;
    metadata.error_across = kWide;
    metadata.surface_to_scan = metadata.scan_to_surface = {kWide, kWide, kWide, kWide};
  }
  metadata.measured_share = metadata.smoothed_share = metadata.filled_share = kWide;
  metadata.folds = faces;
  return metadata;
}

// `coding_error`: of the heights; unset where the options ask for a step or for bytes.
absl::StatusOr<EncodedSurface> Encode(const CodedSurface& coded, std::optional<double> coding_error,
                                      const ReconstructOptions& options, const RunContext& context,
                                      ReconstructReport* report) {
  const StageTimer timer(Stage::kEncode, context, report);
  EncodeOptions encode = options.encode;
  encode.position_step = coded.position_step;
  encode.max_error = coding_error;
  return EncodeDss(coded.surface,
                   WithWidestFigures(coded.metadata, options.measure, report->surface_faces),
                   encode, context);
}

std::optional<double> CodingErrorFor(const ReconstructOptions& options,
                                     const ReconstructReport& report) {
  const EncodeOptions& encode = options.encode;
  if (encode.max_error) return CodingErrorWithin(*encode.max_error, report, options.measure);
  if (encode.height_step > 0 || encode.max_bytes) return std::nullopt;
  return CodingError(report, options.measure);
}

}  // namespace

// V_l is about control_faces / 2 * 4^l.
int LevelAsDenseAs(double points, int64_t control_faces) {
  const double steps = std::log2(2.0 * points / static_cast<double>(control_faces)) / 2;
  return std::clamp(static_cast<int>(std::lround(steps + 0.15)), 1, 6);
}

absl::StatusOr<EncodedSurface> RecodeSurface(const CodedSurface& coded, double coding_error,
                                             const ReconstructOptions& options,
                                             const RunContext& context, ReconstructReport* report) {
  return Encode(coded, coding_error, options, context, report);
}

// Rounded before heights are sampled: the heights take up the rounding.
absl::StatusOr<Domain> RoundDomain(ControlMesh fitted, double position_step) {
  Domain domain;
  domain.position_step = position_step;
  domain.fitted = std::move(fitted);
  RILIEVO_ASSIGN_OR_RETURN(domain.mesh, PrepareControlMesh(domain.fitted, position_step));
  return domain;
}

absl::StatusOr<Domain> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                 const ReconstructOptions& options, const RunContext& context,
                                 ReconstructReport* report) {
  const StageTimer timer(Stage::kDomainFit, context, report);
  report->control_vertices = static_cast<int>(start.vertices.cols());
  report->control_faces = static_cast<int>(start.faces.cols());
  RILIEVO_ASSIGN_OR_RETURN(DomainFit fit,
                           FitLoopDomain(scan.cloud, scan.index, start, options.fit, context));
  report->domain_rms = fit.rms_after;
  report->fit_rounds = fit.rounds;
  report->fit_converged = fit.converged;
  double position_step = options.encode.position_step;
  if (position_step == 0) {
    position_step = PositionStepFor(fit.control_mesh, options.encode.max_error);
  }
  return RoundDomain(std::move(fit.control_mesh), position_step);
}

absl::StatusOr<UncodedSurface> SampleSurfaceHeights(const ScanSurface& scan, Domain domain,
                                                    const ReconstructOptions& options,
                                                    const RunContext& context,
                                                    ReconstructReport* report) {
  RILIEVO_ASSIGN_OR_RETURN(UncodedSurface uncoded,
                           DisplaceAndCut(scan, &domain, options, context, report));
  uncoded.position_step = domain.position_step;
  return uncoded;
}

absl::StatusOr<CodedSurface> CodeSurface(const OrientedCloud& cloud, UncodedSurface sampled,
                                         const DssMetadata& metadata,
                                         const ReconstructOptions& options,
                                         const RunContext& context, ReconstructReport* report,
                                         bool with_tree) {
  if (options.measure) {
    const bool to_keep = options.encode.max_error.has_value();
    RILIEVO_RETURN_IF_ERROR(Measure(cloud, sampled.shape, to_keep, context, report));
    sampled.shape = Shape();
    ReleaseToOsAfter(cloud.points.cols());
  }
  CodedSurface coded;
  coded.metadata = metadata;
  coded.metadata.smoothed_share =
      static_cast<double>(report->heights_smoothed) / static_cast<double>(report->surface_vertices);
  coded.position_step = sampled.position_step;
  coded.surface = std::move(sampled.surface);
  // The encoder keeps one thread busy.
  const auto encode = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        coded.encoded, Encode(coded, CodingErrorFor(options, *report), options, context, report));
    return absl::OkStatus();
  };
  const auto make_tree = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(coded.points_tree, ClosestPointTree::Build(cloud.points, {}, context));
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(with_tree ? RunConcurrently(context, encode, make_tree) : encode());
  return coded;
}

absl::StatusOr<CodedSurface> BuildSurface(const ScanSurface& scan, Domain domain,
                                          const DssMetadata& metadata,
                                          const ReconstructOptions& options,
                                          const RunContext& context, ReconstructReport* report) {
  RILIEVO_ASSIGN_OR_RETURN(UncodedSurface sampled,
                           SampleSurfaceHeights(scan, std::move(domain), options, context, report));
  return CodeSurface(scan.cloud, std::move(sampled), metadata, options, context, report);
}

}  // namespace rilievo
