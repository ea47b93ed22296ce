#include "core/control/choose_topology.h"

#include "absl/strings/str_format.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/settings.h"
#include "core/control/spherical/star_shape.h"

namespace rilievo {

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
  if (plane.unseen_walls <= kChooseTopology.most_unseen_walls &&
      plane.facing >= kChooseTopology.planar_facing) {
    return TopologyChoice{
        Topology::kPlanar,
        absl::StrFormat("the points are a height field over their plane: %.1f %% of the area faces "
                        "it, and hardly any wall would join what no point joins",
                        100 * plane.facing)};
  }
  if (star.coverage >= kChooseTopology.spherical_certain &&
      star.single_sheet >= kChooseTopology.spherical_certain &&
      star.outward >= kChooseTopology.spherical_certain &&
      star.radial >= kChooseTopology.spherical_radial &&
      star.radius_ratio <= kChooseTopology.spherical_radius_ratio) {
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
