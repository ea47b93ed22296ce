#include "core/pipeline/domain_resolution.h"

#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/control/creases/tag_creases.h"
#include "core/control/simplify/coarser_control_mesh.h"
#include "core/pipeline/position_step.h"

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
// Few faces cut tips off that the noise does not hide. What the fit left out of reach, where the
// points face 25 degrees away from the surface, gets faces, so many times: the second finds what
// the first lost, and what stays lost gets more.
constexpr int kMends = 2;
constexpr CoverageLimits kInReach = {.spacings = 0.6, .noises = 2.5, .cosine = 0.9};

// The fit of a mesh of fewer faces that keeps the points in reach.
absl::StatusOr<Domain> MendDomain(const ScanSurface& scan, const ControlMesh& start, int faces,
                                  Domain domain, const ReconstructOptions& options,
                                  const RunContext& context, ReconstructReport* report) {
  UncoveredPoints lost;
  for (int mend = 0; mend < kMends && !IsLeftOut(Mechanism::kMendDomain); ++mend) {
    RILIEVO_ASSIGN_OR_RETURN(
        const UncoveredPoints found,
        FindUncoveredPoints(scan.cloud, domain.fitted, ControlStage::kFitted, kInReach, context));
    if (found.points.empty()) break;
    lost.Add(found);
    RILIEVO_ASSIGN_OR_RETURN(const ControlMesh mesh, FewerFaces(scan, start, faces, context, lost));
    RILIEVO_ASSIGN_OR_RETURN(domain, FitDomain(scan, mesh, options, context, report));
  }
  return domain;
}

}  // namespace

absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context,
                                       const UncoveredPoints& lost) {
  if (start.creases.empty() || IsMachined(start)) {
    return CoarserControlMesh(start, target_faces, context, lost);
  }
  const ControlMesh untagged{start.vertices, start.faces, {}, {}};
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh,
                           CoarserControlMesh(untagged, target_faces, context, lost));
  RILIEVO_RETURN_IF_ERROR(TagCreases(scan.cloud, scan.index, context, &mesh));
  return mesh;
}

absl::StatusOr<Domain> FitUnderNoise(const ScanSurface& scan, const ControlMesh& start,
                                     const ReconstructOptions& options, const RunContext& context,
                                     ReconstructReport* report) {
  if (IsLeftOut(Mechanism::kFewerFaces)) return FitDomain(scan, start, options, context, report);
  const double noise = scan.cloud.median_noise;
  const int fewer = static_cast<int>(kShareOfFaces * static_cast<double>(start.faces.cols()));
  if (fewer < kFewestFaces || noise < kLeastNoiseSpacings * scan.cloud.median_spacing) {
    return FitDomain(scan, start, options, context, report);
  }
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh coarser, FewerFaces(scan, start, fewer, context));
  const bool known = noise > kKnownNoiseSpacings * scan.cloud.median_spacing;
  ReconstructOptions trial = options;
  trial.fit.wanted_rms = (known ? kMostKnownNoise : kMostNoise) * noise;
  RILIEVO_ASSIGN_OR_RETURN(Domain domain, FitDomain(scan, coarser, trial, context, report));
  if (report->domain_rms <= trial.fit.wanted_rms) {
    return MendDomain(scan, start, fewer, std::move(domain), options, context, report);
  }
  return FitDomain(scan, start, options, context, report);
}

}  // namespace rilievo
