#include "core/pipeline/sample_heights.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/control/quads/quad_control_mesh.h"
#include "core/control/topology/trim_unmeasured.h"
#include "core/displacement/continue_curvature.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/heights_in_parts.h"
#include "core/pipeline/settings.h"
#include "core/surface/stored_surface.h"

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
int ChooseLevel(const ReconstructOptions& options, int64_t points, double spacing, double noise,
                int64_t control_faces) {
  if (options.max_level) return *options.max_level;
  const double blur = std::max(1.0, kSampleHeights.noises * noise / spacing);
  int level = LevelAsDenseAs(static_cast<double>(points) / (blur * blur), control_faces);
  while (level > 0 && control_faces > options.max_surface_faces >> (2 * level)) --level;
  return level;
}

// The smooth surface is the mesh that was given, but for the rounding of its vertices. A height
// beyond that comes of a needle, whose normal says nothing.
void DropHeightsOfNeedles(double position_step, DisplacementField* field) {
  const double most = std::numbers::sqrt3 / 2 * position_step;
  for (float& height : field->heights) {
    if (std::abs(height) > most) height = 0;
  }
}

// With the limit surface of all of the mesh at once. `field`: found in parts, or empty.
absl::Status MeasureAtOnce(const ScanSurface& scan, const Domain& domain, const ControlMesh& mesh,
                           int level, const ReconstructOptions& options,
                           const PipelineContext& context, DisplacementField* field, Shape* shape) {
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineToVertices(mesh, level, context));
  const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
  const LevelRings rings =
      level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
  RILIEVO_ASSIGN_OR_RETURN(LimitSurface limit,
                           EvaluateLimit(refinement, mesh.vertices, level, context));
  if (field->heights.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(*field, SampleDisplacement(scan.cloud, refinement, rings, limit,
                                                        options.displacement, context));
  }
  if (options.control.fills_holes()) {
    RILIEVO_RETURN_IF_ERROR(
        ContinueCurvature(refinement, rings, limit, options.displacement, context, field));
  }
  if (domain.is_given) DropHeightsOfNeedles(domain.position_step, field);
  // The border of the smooth surface is exact, and heights would leave it along its normals.
  for (size_t v = 0; scan.borders.any() && v < field->heights.size(); ++v) {
    if (refinement.levels.back().boundary_vertex[v] != 0) field->heights[v] = 0;
  }
  shape->vertices = std::move(limit.positions);
  for (int64_t v = 0; v < limit.normals.cols(); ++v) {
    shape->vertices.col(v) += double{field->heights[v]} * limit.normals.col(v);
  }
  shape->triangles = FinestFaces(refinement);
  shape->children_per_face = 1 << (2 * level);
  return absl::OkStatus();
}

absl::StatusOr<SampledSurface> Displace(const ScanSurface& scan, Domain domain,
                                        const ReconstructOptions& options,
                                        const PipelineContext& context) {
  const StageScope scope(Stage::kDisplacement, context);
  SampledSurface sampled;
  DisplacedSurface& surface = sampled.surface;
  surface.frame = scan.frame;
  RILIEVO_ASSIGN_OR_RETURN(
      surface.control_mesh,
      PrepareControlMesh(domain.fit.control_mesh, domain.position_step, BorderDigitsOf(domain)));
  sampled.domain = std::move(domain);
  const ControlMesh& mesh = surface.control_mesh;
  ReconstructOptions leveled = options;
  if (sampled.domain.is_given && !leveled.max_level) leveled.max_level = 0;
  RILIEVO_ASSIGN_OR_RETURN(const int level,
                           LevelFor(leveled, scan.cloud.points.cols(), scan.cloud.median_spacing,
                                    scan.cloud.median_noise, mesh.faces.cols()));
  surface.max_level = level;
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(mesh));
  DisplacementField field;
  const bool in_parts = VertexCountAt(cutter.topology(), level) > 2 * kSampleHeights.part_vertices;
  if (in_parts) {
    RILIEVO_ASSIGN_OR_RETURN(
        field, MeasureHeightsInParts(scan.cloud, mesh, cutter, level, kSampleHeights.part_vertices,
                                     options.displacement, context));
  }
  const bool needs_all = options.control.fills_holes() || scan.borders.any();
  if (!in_parts || needs_all) {
    RILIEVO_RETURN_IF_ERROR(
        MeasureAtOnce(scan, sampled.domain, mesh, level, options, context, &field, &sampled.shape));
  } else if (sampled.domain.is_given) {
    DropHeightsOfNeedles(sampled.domain.position_step, &field);
  }
  surface.heights = std::move(field.heights);
  surface.sources = std::move(field.source);
  sampled.leverage = field.leverage;
  if (in_parts && !needs_all && options.measure) {
    RILIEVO_ASSIGN_OR_RETURN(sampled.shape, FinestTriangles(surface, context));
  }
  return sampled;
}

}  // namespace

// V_l is about control_faces / 2 * 4^l.
int LevelAsDenseAs(double points, int64_t control_faces) {
  const double steps = std::log2(2.0 * points / static_cast<double>(control_faces)) / 2;
  return std::clamp(static_cast<int>(std::lround(steps + 0.15)), 1, 6);
}

absl::StatusOr<int> LevelFor(const ReconstructOptions& options, int64_t points, double spacing,
                             double noise, int64_t control_faces) {
  const int level = ChooseLevel(options, points, spacing, noise, control_faces);
  RILIEVO_RETURN_IF_ERROR(CheckSurfaceFaces(control_faces, level, options.max_surface_faces));
  return level;
}

absl::StatusOr<SampledSurface> SampleHeights(const ScanSurface& scan, Topology topology,
                                             Domain domain, const ReconstructOptions& options,
                                             const PipelineContext& context) {
  if (options.control.boundary != BoundaryRule::kClose && topology == Topology::kArbitrary) {
    const ControlMesh& mesh = domain.fit.control_mesh;
    RILIEVO_ASSIGN_OR_RETURN(std::vector<float> unmeasured,
                             UnmeasuredShares(mesh, scan.cloud, scan.index, context));
    if (mesh.quads()) ShareBetweenHalves(mesh, &unmeasured);
    RILIEVO_ASSIGN_OR_RETURN(
        ControlMesh cut,
        TrimUnmeasured(mesh, unmeasured, scan.cloud, scan.index,
                       {options.control.close_holes_below, options.control.bridge_gaps_below},
                       context));
    if (cut.faces.cols() < mesh.faces.cols()) {
      RILIEVO_ASSIGN_OR_RETURN(domain, FitDomain(scan, cut, options, context));
    }
  }
  return Displace(scan, std::move(domain), options, context);
}

}  // namespace rilievo
