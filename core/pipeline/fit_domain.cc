#include "core/base/xp.h"
#include "core/pipeline/fit_domain.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/control/creases/tag_creases.h"
#include "core/control/quads/quad_control_mesh.h"
#include "core/control/simplify/coarser_control_mesh.h"
#include "core/domain/fill_by_arcs.h"

namespace rilievo {
namespace {

constexpr double kShareOfFaces = 0.21;
constexpr int kFewestFaces = 100;
constexpr double kLeastNoiseSpacings = 0.08;
// RMS distance of the points from the domain, in standard deviations of their noise. At a fifth of
// the faces smooth objects came to 1.14 under little noise, of which the nearest points show too
// little, and to 1.04 at most from the ratio to the spacing on at which its scale is known
// (thick_noise.h); thin walls and detail to 1.8 and more, and to 1.11.
constexpr double kMostNoise = 1.22, kMostKnownNoise = 1.07;
constexpr double kKnownNoiseSpacings = 1.0 / 3;
// Of points on the triangles of a mesh, where the domain does without heights: a tenth of the 0.01
// % that conversions are to keep.
constexpr double kExactRms = 1e-5;
constexpr int kFewestExact = 24;  // faces

// Of position steps.
constexpr double kCoarsestStep = 5e-3;
constexpr double kFinestOfLines = 1e-4;
constexpr double kOfShortEdges = 0.1,
                 kShort = 0.05;  // the edge that 5 % are shorter than
constexpr double kOfCodingError = 4;
constexpr int kEdgesPerCrease = 50;  // a part with fewer creases than that counts as smooth

double ShortEdge(const ControlMesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<size_t>(mesh.faces.size()));
  for (const auto face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      lengths.push_back((mesh.vertices.col(face[k]) - mesh.vertices.col(face[(k + 1) % 3])).norm());
    }
  }
  if (lengths.empty()) return 0;
  const auto short_edge =
      lengths.begin() + static_cast<std::ptrdiff_t>(kShort * static_cast<double>(lengths.size()));
  std::nth_element(lengths.begin(), short_edge, lengths.end());
  return *short_edge;
}

// What a domain of fewer faces has to be to be kept.
struct FewFaces {
  double wanted_rms = 0;  // of the points from it; 0: none is tried
  int fewest = 0;
};

FewFaces WhatFewFacesNeed(double noise, double spacing, int64_t triangles, int64_t faces) {
  if (noise >= kLeastNoiseSpacings * spacing) {
    const bool known = noise > kKnownNoiseSpacings * spacing;
    const int a_fifth = static_cast<int>(kShareOfFaces * static_cast<double>(faces));
    return {(XP("oneknown") ? XPN("KN", 1.1) : known ? kMostKnownNoise : kMostNoise) * noise, std::max(kFewestFaces, a_fifth)};
  }
  return {triangles > 0 && triangles < faces ? kExactRms : 0, kFewestExact};
}

}  // namespace

bool IsMachined(const ControlMesh& mesh) {
  return static_cast<int64_t>(mesh.creases.size()) * kEdgesPerCrease > 3 * mesh.faces.cols() / 2;
}

double PositionStepFor(const ControlMesh& mesh, std::optional<double> coding_error) {
  const double smooth = std::clamp(kOfShortEdges * ShortEdge(mesh), kPositionStep, kCoarsestStep);
  if (XP("nomach") || !IsMachined(mesh)) return smooth;
  const double flat = coding_error ? kOfCodingError * *coding_error : kPositionStep;
  return std::clamp(flat, kPositionStep, smooth);
}

absl::StatusOr<Domain> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                 const ReconstructOptions& options,
                                 const PipelineContext& context) {
  const StageScope scope(Stage::kDomainFit, context);
  Domain domain;
  std::optional<ControlMesh> quads;
  if (options.control.scheme == DomainScheme::kCatmullClark) {
    RILIEVO_ASSIGN_OR_RETURN(quads, QuadControlMesh(start));
  }
  RILIEVO_ASSIGN_OR_RETURN(domain.fit, FitLoopDomain(scan.cloud, scan.index, quads ? *quads : start,
                                                     options.fit, context));
  if (options.control.fills_holes()) {
    RILIEVO_ASSIGN_OR_RETURN(domain.is_filled,
                             FillByArcs(scan.cloud, scan.index, context, &domain.fit.control_mesh));
  }
  domain.position_step = options.encode.position_step;
  if (domain.position_step == 0) {
    domain.position_step = PositionStepFor(domain.fit.control_mesh, options.encode.max_error);
    // Heights take up no rounding that moves a crease aside.
    if (scan.cloud.sharp_lines.cols() > 0) {
      const double finest = std::max(kFinestOfLines, options.encode.max_error.value_or(0));
      domain.position_step = std::min(domain.position_step, finest);
    }
    if (domain.is_filled) domain.position_step = std::min(domain.position_step, kStepWhereFilled);
  }
  return domain;
}

absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context) {
  if (XP("untag") || start.creases.empty() || IsMachined(start) || scan.cloud.sharp_lines.cols() > 0) {
    return CoarserControlMesh(start, target_faces, context);
  }
  const ControlMesh untagged{start.vertices, start.faces, {}, {}};
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh, CoarserControlMesh(untagged, target_faces, context));
  RILIEVO_RETURN_IF_ERROR(TagCreases(scan.cloud, scan.index, context, &mesh));
  return mesh;
}

absl::StatusOr<Domain> FitFewFaces(const ScanSurface& scan, double spacing, int64_t triangles,
                                   const ControlMesh& start, const ReconstructOptions& options,
                                   const PipelineContext& context) {
  const FewFaces need =
      WhatFewFacesNeed(scan.cloud.median_noise, spacing, triangles, start.faces.cols());
  ReconstructOptions trial = options;
  trial.fit.wanted_rms = need.wanted_rms;
  std::optional<Domain> few;
  auto faces = static_cast<double>(start.faces.cols());
  while (need.wanted_rms > 0 && !IsLeftOut(Mechanism::kFewerFaces)) {
    faces *= kShareOfFaces;
    if (faces < need.fewest) break;
    RILIEVO_ASSIGN_OR_RETURN(const ControlMesh coarser,
                             FewerFaces(scan, start, static_cast<int>(faces), context));
    RILIEVO_ASSIGN_OR_RETURN(Domain domain, FitDomain(scan, coarser, trial, context));
    const bool fewer = coarser.faces.cols() < (few ? few->fit.control_mesh : start).faces.cols();
    if (!fewer || domain.fit.rms_after > need.wanted_rms) break;
    few = std::move(domain);
  }
  if (few) return *std::move(few);
  return FitDomain(scan, start, options, context);
}

}  // namespace rilievo
