// Points that heights over a control mesh's surface cannot come to.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

struct OutOfReach {
  std::vector<int> points;  // of the cloud, ascending
  int faces = 0;            // of the control mesh, those nearest to these points
};

// A point is out of reach of the Loop surface through the vertices of `control` where it lies more
// than its spacing off it, and more than its noise explains, and faces another way: a tip that was
// cut off, the sides of two prongs with a web between them. Heights along the surface's normals
// come to none of them, and a fit gives such points to no sample. INVALID_ARGUMENT for a mesh that
// is no manifold; CANCELLED when stopped.
absl::StatusOr<OutOfReach> FindOutOfReach(const OrientedCloud& cloud, const ControlMesh& control,
                                          const RunContext& context);

}  // namespace rilievo
