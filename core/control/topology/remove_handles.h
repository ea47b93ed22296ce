// Topological noise: handles too small to be supported by the points (Guskov and Wood 2001).
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/topology/loop_support.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct HandleRemoval {
  ControlMesh mesh;
  int removed = 0;  // each lowered the genus by one
};

// Of loops of edges, in the unit of the mesh.
struct HandleLengths {
  double longest = 0;
  // Up to here the points are too far apart to say that a loop is open.
  double tiny = 0;
};

// Cuts every handle that has a non-separating loop of edges no longer than the longest along such a
// loop, and closes both sides with a fan of triangles; so for each of `searches` in turn. `mesh`:
// an orientable 2-manifold; so is the result. Loops that touch the boundary are left alone. If
// `support` is not null, loops that its points line are left alone too, and so are loops that are
// not tiny and that its points leave open.
absl::StatusOr<HandleRemoval> RemoveHandles(ControlMesh mesh,
                                            std::span<const HandleLengths> searches,
                                            const LoopSupport* support, const RunContext& context);

}  // namespace rilievo
