#include "core/control/choose_topology.h"

#include "absl/strings/str_format.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/spherical/star_shape.h"

namespace rilievo {
namespace {

// Lidar terrain with trees: 94 % single sheets, 85 % facing up, its tree tops having normals of
// any direction. A closed surface faces any plane with at most about half its area.
constexpr double kPlanarSingleSheet = 0.92;
constexpr double kPlanarFacing = 0.8;

// The octahedron spends its faces evenly over the directions: no loss against topology arbitrary
// only where the surface is seen nearly head-on from the centre, at about one distance.
constexpr double kSphericalCertain = 0.999;
constexpr double kSphericalRadial = 0.99;
constexpr double kSphericalRadiusRatio = 2.0;

}  // namespace

absl::StatusOr<TopologyChoice> ChooseTopology(const OrientedCloud& cloud,
                                              const RunContext& context) {
  // Each keeps one thread busy.
  HeightFieldCheck plane;
  StarCheck star;
  const auto check_plane = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(plane, CheckHeightField(cloud, FitPlaneFrame(cloud), context));
    return absl::OkStatus();
  };
  const auto check_star = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(star, CheckStarShape(cloud, FindStarCenter(cloud), context));
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, check_plane, check_star));
  if (plane.single_sheet >= kPlanarSingleSheet && plane.facing >= kPlanarFacing) {
    return TopologyChoice{
        Topology::kPlanar,
        absl::StrFormat("the points are a height field over their plane: one sheet over %.1f %% "
                        "of it, and %.1f %% of the area faces it",
                        100 * plane.single_sheet, 100 * plane.facing)};
  }
  if (star.coverage >= kSphericalCertain && star.single_sheet >= kSphericalCertain &&
      star.outward >= kSphericalCertain && star.radial >= kSphericalRadial &&
      star.radius_ratio <= kSphericalRadiusRatio) {
    return TopologyChoice{
        Topology::kSpherical,
        absl::StrFormat("the points close around a centre from which every ray meets them once, "
                        "at distances that differ by a factor of %.2f",
                        star.radius_ratio)};
  }
  return TopologyChoice{
      Topology::kArbitrary,
      absl::StrFormat("the points are neither a height field (one sheet over %.0f %% of their "
                      "plane, %.0f %% of the area facing it) nor a closed round body (met in "
                      "%.0f %% of the directions from its centre, once in %.0f %% of those)",
                      100 * plane.single_sheet, 100 * plane.facing, 100 * star.coverage,
                      100 * star.single_sheet)};
}

}  // namespace rilievo
