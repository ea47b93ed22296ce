// The control mesh, for one of four topologies: planar, spherical, arbitrary, given by the user.
#pragma once

#include <Eigen/Core>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct ControlMeshResult {
  ControlMesh mesh;  // unit frame
  // The one given, but that kArbitrary flips the normals that disagree with the surface it found.
  OrientedCloud cloud;
  Topology topology;   // never kAuto
  std::string reason;  // one sentence: why this topology
  int components = 0;
  int boundary_loops = 0;
  int genus = 0;
};

// How many of the points tell of shape, for DefaultControlFaces(): as many as there would be if
// none were closer together than its noise is thick, by the median of each stretch. More of them
// fill the volume that noise makes of the surface, and only average it. 20 000 tell in any case.
// The cloud is a sample of `points` that are `closer` times (0, 1] as far apart.
int64_t TellingPoints(const OrientedCloud& cloud, int64_t points, double closer);

// The rule behind target_faces = 0: one face for 30 points, 200 at least, whose third subdivision
// has about as many vertices as there are points; from 12 000 on one for 120 points, 200 000 at
// most.
int DefaultControlFaces(int64_t points);

// `target_faces`, or four for each point (200 at least) where that is fewer: no scan tells more.
int UsefulControlFaces(int target_faces, int64_t points);

// As many as the options ask for, or as suit the points.
int ControlFacesFor(const ControlOptions& options, const OrientedCloud& cloud);

// Sets components, boundary_loops and genus. INTERNAL unless the mesh is an oriented manifold.
absl::Status AddTopologyFigures(ControlMeshResult* result);

// `graph` and `index` are those of the cloud's points, `frame` their unit frame. The graph's memory
// goes before the mesh is simplified.
// FAILED_PRECONDITION, naming a topology that would do, when the one asked for does not suit the
// cloud. One that was chosen here and does not suit it is replaced by kArbitrary, and the reason
// says so.
absl::StatusOr<ControlMeshResult> BuildControlMesh(OrientedCloud cloud, NeighborGraph graph,
                                                   const PointIndex& index,
                                                   const SpatialFrame& frame,
                                                   const ControlOptions& options,
                                                   const RunContext& context);

}  // namespace rilievo
