// The control mesh by one of four roads: planar, spherical, arbitrary topology, given by the user.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

enum class Topology { kAuto, kPlanar, kSpherical, kArbitrary, kUser };
enum class BoundaryRule {
  kKeep,   // an open scan stays open
  kClose,  // holes and open borders are closed
};

enum class CreaseRule {
  kAuto,  // the road arbitrary tags edges of the control mesh that follow sharp edges of the scan
  kOff,
};

const char* TopologyName(Topology topology);

struct ControlOptions {
  Topology topology = Topology::kAuto;
  BoundaryRule boundary = BoundaryRule::kKeep;
  CreaseRule creases = CreaseRule::kAuto;
  // About how many control faces; 0: chosen from the number of points. [0, 200000], of which
  // UsefulControlFaces are made.
  int target_faces = 0;
  // The road kUser, also taken under kAuto when this is set: used as it is, after checks. Unit
  // frame.
  std::optional<ControlMesh> user_mesh;
  absl::Status Validate() const;
};

struct ControlMeshResult {
  ControlMesh mesh;    // unit frame
  Topology road;       // never kAuto
  std::string reason;  // one sentence: why this road
  int components = 0;
  int boundary_loops = 0;
  int genus = 0;
};

// The rule behind target_faces = 0: one face for 30 points, in [200, 12000]. Three subdivisions of
// that give about as many vertices as there are points.
int DefaultControlFaces(const OrientedCloud& cloud);

// `target_faces`, or four for each point (200 at least) where that is fewer: no scan tells more.
int UsefulControlFaces(int target_faces, int64_t points);

// How many faces the road kSpherical makes of so many asked for.
int SphericalControlFaces(int target_faces);

// FAILED_PRECONDITION when the chosen road cannot serve the cloud, with the road that could.
// When the road was chosen here and fails so, the road arbitrary is taken and the reason says it.
// The road arbitrary turns the cloud's normals where the surface that it finds runs the other way.
absl::StatusOr<ControlMeshResult> BuildControlMesh(const NeighborGraph& graph,
                                                   const PointIndex& index,
                                                   const ControlOptions& options,
                                                   const RunContext& context, OrientedCloud* cloud);

}  // namespace rilievo
