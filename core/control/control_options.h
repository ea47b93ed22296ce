// What a caller may ask of the control mesh.
#pragma once

#include <optional>

#include "absl/status/status.h"
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
  kClose,  // holes and open borders are closed
};

enum class CreaseRule {
  kAuto,  // topology arbitrary tags edges of the control mesh that follow sharp edges of the scan
  kOff,
};

const char* TopologyName(Topology topology);

struct ControlOptions {
  Topology topology = Topology::kAuto;
  BoundaryRule boundary = BoundaryRule::kKeep;
  CreaseRule creases = CreaseRule::kAuto;
  // About how many control faces; 0: chosen from the number of points. [0, 200000], of which
  // UsefulControlFaces() are made.
  int target_faces = 0;
  // For topology kUser, which kAuto stands for when this is set: used as it is, after checks. In
  // the frame of the scan.
  std::optional<ControlMesh> user_mesh;
  absl::Status Validate() const;
};

}  // namespace rilievo
