// A mesh cut finer, so that a control mesh can be simplified out of it.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// `mesh`, a manifold without creases, with no edge longer than `longest` (> 0; frame of the mesh):
// longer ones are halved in rounds, and a triangle of one, two or three halved edges is cut in two,
// three or four. A vertex where more than 64 triangles meet, such as the tip of a cone, gets rings
// around it, each of half as many edges as the one outside: a collapse there looks at all of them.
// RESOURCE_EXHAUSTED beyond 2^28 faces; CANCELLED when stopped.
absl::StatusOr<ControlMesh> SplitLongEdges(ControlMesh mesh, double longest,
                                           const RunContext& context);

}  // namespace rilievo
