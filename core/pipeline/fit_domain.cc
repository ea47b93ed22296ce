#include "core/pipeline/fit_domain.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/codec/mesh/border_coder.h"
#include "core/control/creases/tag_creases.h"
#include "core/control/quads/quad_control_mesh.h"
#include "core/control/settings.h"
#include "core/control/simplify/coarser_control_mesh.h"
#include "core/domain/fill_by_arcs.h"
#include "core/domain/fit_border.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"
#include "core/meshes/split_edges.h"
#include "core/pipeline/domain_of_mesh.h"
#include "core/pipeline/settings.h"
#include "core/scan/local_shape/settings.h"
#include "core/scan/local_shape/thick_noise.h"
#include "core/surface/measure_error.h"

namespace rilievo {
namespace {

double ShortEdge(const ControlMesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<size_t>(mesh.faces.size()));
  for (const auto face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      lengths.push_back((mesh.vertices.col(face[k]) - mesh.vertices.col(face[(k + 1) % 3])).norm());
    }
  }
  return Quantile(std::move(lengths), kFitDomain.short_share);
}

// What a domain of fewer faces has to be to be kept.
struct FewFaces {
  double wanted_rms = 0;  // of the points from it; 0: none is tried
  int fewest = 0;
};

FewFaces WhatFewFacesNeed(double noise, double spacing, int64_t triangles, int64_t faces) {
  if (noise >= kFitDomain.least_noise_spacings * spacing) {
    const bool known = noise > kThickNoise.understated_noise * spacing;
    const int a_fifth = static_cast<int>(kFitDomain.share_of_faces * static_cast<double>(faces));
    return {(known ? kFitDomain.most_known_noise : kFitDomain.most_noise) * noise,
            std::max(kFitDomain.fewest_faces, a_fifth)};
  }
  return {triangles > 0 && triangles < faces ? kControlOptions.exact_border : 0,
          kFitDomain.fewest_exact};
}

// Whether the smooth surface of `domain` comes to all of `mesh`, that it lies on: where it ends
// inside of the border of a flat part no point of its own tells.
absl::StatusOr<bool> ReachesAll(const Domain& domain, const Shape& mesh, double wanted_rms,
                                const PipelineContext& context) {
  const StageScope scope(Stage::kDomainFit, context, 1);
  const ControlMesh& control = domain.fit.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(control, kFitDomain.level_of_reach, context));
  RILIEVO_ASSIGN_OR_RETURN(LimitSurface limit, EvaluateLimit(refinement, control.vertices,
                                                             kFitDomain.level_of_reach, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const DistanceSummary distance,
      MeasureOneSided(mesh, {std::move(limit.positions), FinestFaces(refinement)},
                      {.samples = kFitDomain.samples_of_reach}, context));
  return distance.rms <= wanted_rms;
}

double PositionStepOf(const ScanSurface& scan, const ReconstructOptions& options,
                      const Domain& domain) {
  if (options.encode.position_step != 0) return options.encode.position_step;
  double step = PositionStepFor(domain.fit.control_mesh, options.encode.max_error);
  // Heights take up no rounding that moves a crease aside.
  if (scan.cloud.sharp_lines.cols() > 0) {
    step =
        std::min(step, std::max(kFitDomain.finest_of_lines, options.encode.max_error.value_or(0)));
  }
  return domain.is_filled ? std::min(step, kFitDomain.step_where_filled) : step;
}

// Halves edges of the border until its curve comes to the lines.
absl::Status RefineBorder(const KnownBorders& borders, const RunContext& context,
                          ControlMesh* mesh) {
  for (int halvings = 0;; ++halvings) {
    RILIEVO_ASSIGN_OR_RETURN(
        const BorderMiss miss,
        FitBorder(borders, kFitDomain.miss_of_borders * kControlOptions.exact_border, context,
                  mesh));
    if (miss.far.empty() || halvings == kFitDomain.most_halvings) return absl::OkStatus();
    *mesh = HalveEdges(*mesh, miss.far);
  }
}

absl::StatusOr<std::vector<int>> VerticesOnBorder(const ControlMesh& mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  std::vector<int> vertices;
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (topology.boundary_vertex[static_cast<size_t>(v)] != 0) vertices.push_back(v);
  }
  return vertices;
}

std::vector<int> CornersAmong(const std::vector<int>& vertices, const ControlMesh& mesh) {
  std::vector<int> corners;
  std::copy_if(vertices.begin(), vertices.end(), std::back_inserter(corners), [&](int v) {
    return std::find(mesh.corners.begin(), mesh.corners.end(), v) != mesh.corners.end();
  });
  return corners;
}

}  // namespace

int BorderDigitsOf(const Domain& domain) {
  if (!domain.has_exact_border) return 0;
  const double finer = std::ceil(std::log2(
      domain.position_step / (kFitDomain.step_of_borders * kControlOptions.exact_border)));
  return static_cast<int>(std::clamp<double>(finer, 0, kMostBorderDigits));
}

bool IsMachined(const ControlMesh& mesh) {
  return static_cast<int64_t>(mesh.creases.size()) * kFitDomain.edges_per_crease >
         3 * mesh.faces.cols() / 2;
}

double PositionStepFor(const ControlMesh& mesh, std::optional<double> coding_error) {
  const double smooth = std::clamp(kFitDomain.of_short_edges * ShortEdge(mesh), kPositionStep,
                                   kFitDomain.coarsest_step);
  if (!IsMachined(mesh)) return smooth;
  const double flat = coding_error ? kFitDomain.of_coding_error * *coding_error : kPositionStep;
  return std::clamp(flat, kPositionStep, smooth);
}

absl::StatusOr<Domain> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                 const ReconstructOptions& options,
                                 const PipelineContext& context) {
  const StageScope scope(Stage::kDomainFit, context);
  Domain domain;
  ControlMesh mesh = start;
  if (scan.borders.any()) {
    RILIEVO_RETURN_IF_ERROR(RefineBorder(scan.borders, context, &mesh));
  }
  if (options.control.scheme == DomainScheme::kCatmullClark && !mesh.quads()) {
    RILIEVO_ASSIGN_OR_RETURN(mesh, QuadControlMesh(mesh));
  }
  RILIEVO_ASSIGN_OR_RETURN(domain.fit,
                           FitLoopDomain(scan.cloud, scan.index, mesh, options.fit, context));
  if (options.control.fills_holes()) {
    RILIEVO_ASSIGN_OR_RETURN(domain.is_filled,
                             FillByArcs(scan.cloud, scan.index, context, &domain.fit.control_mesh));
  }
  domain.position_step = PositionStepOf(scan, options, domain);
  domain.has_exact_border = scan.borders.any();
  if (domain.has_exact_border) {
    // A fit to points slides corners along the border, farther than to their neighbours where edges
    // are short, and across a slit it draws control points to the wrong side.
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> border, VerticesOnBorder(mesh));
    const std::vector<int> corners = CornersAmong(border, mesh);
    ControlMesh unmoved = domain.fit.control_mesh;
    unmoved.vertices(Eigen::all, border) = mesh.vertices(Eigen::all, border);
    domain.fit.control_mesh.vertices(Eigen::all, corners) = mesh.vertices(Eigen::all, corners);
    RILIEVO_ASSIGN_OR_RETURN(
        const BorderMiss miss,
        FitBorder(scan.borders, kFitDomain.miss_of_borders * kControlOptions.exact_border, context,
                  &domain.fit.control_mesh));
    RILIEVO_ASSIGN_OR_RETURN(
        const BorderMiss other,
        FitBorder(scan.borders, kFitDomain.miss_of_borders * kControlOptions.exact_border, context,
                  &unmoved));
    if (other.most < miss.most) domain.fit.control_mesh = std::move(unmoved);
    const double step = std::ldexp(domain.position_step, -BorderDigitsOf(domain));
    domain.border_miss = std::min(miss.most, other.most) + std::numbers::sqrt3 / 2 * step;
  }
  return domain;
}

absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context) {
  if (start.creases.empty() || IsMachined(start) || scan.cloud.sharp_lines.cols() > 0) {
    return CoarserControlMesh(start, target_faces, context);
  }
  const ControlMesh untagged{start.vertices, start.faces, {}, {}};
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh, CoarserControlMesh(untagged, target_faces, context));
  RILIEVO_RETURN_IF_ERROR(TagCreases(scan.cloud, scan.index, context, &mesh));
  return mesh;
}

std::optional<Domain> DomainOfMesh(const ScanSurface& scan, const Shape& mesh, int64_t faces,
                                   const ReconstructOptions& options) {
  const ControlOptions& control = options.control;
  if (control.scheme != DomainScheme::kLoop || control.creases != CreaseRule::kAuto ||
      control.fills_holes() || control.bridge_gaps_below > 0) {
    return {};
  }
  std::optional<ControlMesh> control_mesh = ControlMeshOfFewTriangles(mesh, faces);
  if (!control_mesh) return {};
  Domain domain;
  domain.fit.control_mesh = *std::move(control_mesh);
  domain.fit.converged = domain.is_given = true;
  domain.position_step = PositionStepOf(scan, options, domain);
  domain.has_exact_border = scan.borders.any();
  return domain;
}

absl::StatusOr<Domain> FitFewFaces(const ScanSurface& scan, double spacing, const Shape& mesh,
                                   const ControlMesh& start, const ReconstructOptions& options,
                                   const PipelineContext& context) {
  const FewFaces need =
      WhatFewFacesNeed(scan.cloud.median_noise, spacing, mesh.triangles.cols(), start.faces.cols());
  ReconstructOptions trial = options;
  trial.fit.wanted_rms = need.wanted_rms;
  std::optional<Domain> few;
  auto faces = static_cast<double>(start.faces.cols());
  while (need.wanted_rms > 0 && !IsLeftOut(Mechanism::kFewerFaces)) {
    faces *= kFitDomain.share_of_faces;
    if (faces < need.fewest) break;
    RILIEVO_ASSIGN_OR_RETURN(const ControlMesh coarser,
                             FewerFaces(scan, start, static_cast<int>(faces), context));
    RILIEVO_ASSIGN_OR_RETURN(Domain domain, FitDomain(scan, coarser, trial, context));
    const bool fewer = coarser.faces.cols() < (few ? few->fit.control_mesh : start).faces.cols();
    if (!fewer || domain.fit.rms_after > need.wanted_rms) break;
    if (mesh.triangles.cols() > 0) {
      RILIEVO_ASSIGN_OR_RETURN(const bool reaches,
                               ReachesAll(domain, mesh, need.wanted_rms, context));
      if (!reaches) break;
    }
    few = std::move(domain);
  }
  const int64_t fewest = few ? few->fit.control_mesh.faces.cols() : start.faces.cols();
  if (std::optional<Domain> given = DomainOfMesh(scan, mesh, fewest, options)) {
    return *std::move(given);
  }
  if (few) return *std::move(few);
  return FitDomain(scan, start, options, context);
}

}  // namespace rilievo
