// A Loop surface through the vertices of a mesh.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct InterpolationOptions {
  // Steps of the iteration, [0, 1000]. The surface passes through the vertices after any number of
  // them; more make it more alike to the limit surface of the given mesh.
  int most_steps = 60;
  // It stops before, once a step leaves this share of the first residual. [0, 1).
  double tolerance = 1e-8;
  absl::Status Validate() const;
};

struct InterpolatedMesh {
  // The given mesh, each face split into four: the given vertices first, then one an edge, in the
  // order of BuildMeshTopology(). The limit position of vertex v < V is the given vertex v.
  ControlMesh mesh;
  int steps = 0;
};

// Similarity-based interpolation (S. Lai and F. Cheng, "Similarity based interpolation using
// Catmull-Clark subdivision surfaces", The Visual Computer 22, 2006), for Loop's scheme. The
// control mesh is the given one after a step of subdivision, plus a difference. The differences of
// the new vertices are free; that of a given vertex follows from those around it, by its limit
// mask, so that no choice of the others can miss it. They are chosen such that second differences
// of the surface, the umbrella vectors of its control mesh, are as near as possible to those of the
// limit surface of the given mesh: then nothing needs to be faired. Conjugate gradients find them;
// there is no system that has to be solved, for each of their steps gives a surface through all
// vertices. Along creases and borders the umbrella has the two neighbours of that line.
//
// `mesh`: open or closed, any unit, creases and corners as in ControlMesh. INVALID_ARGUMENT for
// coordinates that are not finite, options out of range, and what RefineTopology() refuses;
// CANCELLED.
absl::StatusOr<InterpolatedMesh> InterpolateVertices(const ControlMesh& mesh,
                                                     const InterpolationOptions& options,
                                                     const RunContext& context);

}  // namespace rilievo
