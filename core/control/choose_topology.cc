#include "core/base/xp.h"
#include "core/control/choose_topology.h"

#include "absl/strings/str_format.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/spherical/star_shape.h"

namespace rilievo {
namespace {

// A height field makes a wall of every step, be it a roof's edge or a border in depth. Terrain has
// none; on the airborne block of docs/accuracy.md they come to 8 % of the area, and the RMS of a
// height field was 2.6 to 7 times that of an arbitrary mesh.
constexpr double kMostUnseenWalls = 0.01;
// A closed surface faces any plane with at most about half its area.
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
  if (!XP("noplanar") && plane.unseen_walls <= kMostUnseenWalls && plane.facing >= kPlanarFacing) {
    return TopologyChoice{
        Topology::kPlanar,
        absl::StrFormat("the points are a height field over their plane: %.1f %% of the area faces "
                        "it, and hardly any wall would join what no point joins",
                        100 * plane.facing)};
  }
  if (!XP("nosphere") && star.coverage >= kSphericalCertain && star.single_sheet >= kSphericalCertain &&
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
      absl::StrFormat(
          "the points are neither a height field (%.0f %% of the area faces their "
          "plane; walls that no point saw would add %.0f %%) nor a closed round body "
          "(met in %.0f %% of the directions from its centre, once in %.0f %% of those)",
          100 * plane.facing, 100 * plane.unseen_walls, 100 * star.coverage,
          100 * star.single_sheet)};
}

}  // namespace rilievo
