#include "core/pipeline/fit_under_noise.h"

#include <utility>

#include "core/base/status_macros.h"
#include "core/control/coarser_control_mesh.h"

namespace rilievo {
namespace {

constexpr double kShareOfFaces = 0.21;
constexpr int kFewestFaces = 100;
constexpr double kLeastNoiseSpacings = 0.08;
// RMS distance of the points from the domain, in standard deviations of their noise. Smooth objects
// came to 1.03 at all faces and 1.11 at a fifth, thin walls to 1.1 and 2.1.
constexpr double kMostNoise = 1.22;

}  // namespace

absl::StatusOr<Domain> FitUnderNoise(const ScanSurface& scan, const ControlMesh& start,
                                     const ReconstructOptions& options, const RunContext& context,
                                     ReconstructReport* report) {
  const double noise = scan.cloud.median_noise;
  const int fewer = static_cast<int>(kShareOfFaces * static_cast<double>(start.faces.cols()));
  if (fewer < kFewestFaces || noise < kLeastNoiseSpacings * scan.cloud.median_spacing) {
    return FitDomain(scan, start, options, context, report);
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const ControlMesh coarser,
      CoarserControlMesh(scan.cloud, scan.index, start, fewer, options.control.creases, context));
  RILIEVO_ASSIGN_OR_RETURN(Domain domain, FitDomain(scan, coarser, options, context, report));
  if (report->domain_rms <= kMostNoise * noise) return domain;
  return FitDomain(scan, start, options, context, report);
}

}  // namespace rilievo
