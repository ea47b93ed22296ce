// What a caller may ask of the control mesh.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "core/control/settings.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

enum class Topology {
  kAuto,
  kPlanar,
  kSpherical,
  kArbitrary,
  kUser,
  kMesh,  // that of a given mesh; not to be asked for
};
enum class BoundaryRule {
  kKeep,   // an open scan stays open
  kClose,  // holes and open borders are closed; topology planar keeps its outer border
  kExact,  // of a mesh: its borders are met within kControlOptions.exact_border
};

enum class CreaseRule {
  kAuto,  // topology arbitrary tags edges of the control mesh that follow sharp edges of the scan
  kOff,
};

enum class DomainScheme {
  kLoop,          // of triangles
  kCatmullClark,  // of quads, which QuadControlMesh() makes of the triangles
};

const char* TopologyName(Topology topology);

struct ControlOptions {
  Topology topology = Topology::kAuto;
  BoundaryRule boundary = BoundaryRule::kKeep;
  CreaseRule creases = CreaseRule::kAuto;
  DomainScheme scheme = DomainScheme::kLoop;  // of the smooth surface; with user_mesh kLoop
  // Holes whose rim is shorter are closed under BoundaryRule::kKeep too, see CloseHoles(); fraction
  // of the diagonal. 0 (none) or [kControlOptions.shortest_rim, kControlOptions.longest_rim].
  double close_holes_below = 0;
  // Gaps between pieces that are narrower are bridged, whatever the boundary rule, see
  // BridgeGaps(); fraction of the diagonal. 0 (none) or [kControlOptions.narrowest_gap,
  // kControlOptions.widest_gap].
  double bridge_gaps_below = 0;
  // About how many control faces; 0: chosen from the number of points. [0, 200000], of which
  // UsefulControlFaces() are made.
  int target_faces = 0;
  // For topology kUser, which kAuto stands for when this is set: used as it is, after checks. In
  // the frame of the scan.
  std::optional<ControlMesh> user_mesh;
  absl::Status Validate() const;

  // Whether parts that no point tells of are made on purpose.
  bool fills_holes() const {
    return boundary == BoundaryRule::kClose || close_holes_below > 0 || bridge_gaps_below > 0;
  }
};

}  // namespace rilievo
