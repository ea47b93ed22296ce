#include "core/control/control_options.h"

#include "absl/strings/str_cat.h"
#include "core/control/settings.h"

namespace rilievo {

const char* TopologyName(Topology topology) {
  switch (topology) {
    case Topology::kAuto:
      return "auto";
    case Topology::kPlanar:
      return "planar";
    case Topology::kSpherical:
      return "spherical";
    case Topology::kArbitrary:
      return "arbitrary";
    case Topology::kUser:
      return "user";
    case Topology::kMesh:
      return "mesh";
  }
  return "unknown";
}

absl::Status ControlOptions::Validate() const {
  if (target_faces < 0 || target_faces > kControlOptions.most_control_faces) {
    return absl::InvalidArgumentError(absl::StrCat("target_faces is ", target_faces,
                                                   "; it must lie in [0, ",
                                                   kControlOptions.most_control_faces, "]"));
  }
  if (close_holes_below != 0 && !(close_holes_below >= kControlOptions.shortest_rim &&
                                  close_holes_below <= kControlOptions.longest_rim)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "close_holes_below is ", close_holes_below, " of the diagonal; it must be 0 or lie in [",
        kControlOptions.shortest_rim, ", ", kControlOptions.longest_rim, "]"));
  }
  if (bridge_gaps_below != 0 && !(bridge_gaps_below >= kControlOptions.narrowest_gap &&
                                  bridge_gaps_below <= kControlOptions.widest_gap)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "bridge_gaps_below is ", bridge_gaps_below, " of the diagonal; it must be 0 or lie in [",
        kControlOptions.narrowest_gap, ", ", kControlOptions.widest_gap, "]"));
  }
  if (topology == Topology::kMesh) {
    return absl::InvalidArgumentError("topology mesh is that of a given mesh; leave it auto");
  }
  if (user_mesh && scheme != DomainScheme::kLoop) {
    return absl::InvalidArgumentError(
        "scheme is catmull-clark, but user_mesh is set, whose triangles are used as they are; take "
        "scheme loop, or leave the mesh out");
  }
  if (topology == Topology::kUser && !user_mesh) {
    return absl::InvalidArgumentError("topology user needs user_mesh");
  }
  if (user_mesh && topology != Topology::kUser && topology != Topology::kAuto) {
    return absl::InvalidArgumentError(absl::StrCat(
        "user_mesh is set, but topology is ", TopologyName(topology), "; it must be user or auto"));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
