// Solids that only touch, taken apart.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct SeparatedSolids {
  TriangleMesh mesh;     // without triangles: nothing was left
  bool touched = false;  // whether there were contacts
};

// Where how solids hang together cannot be told: FAILED_PRECONDITION.
absl::Status TouchesTooFlatly();

// `mesh`, an oriented 2-manifold without boundary. Parts of it that hang together through necks
// narrower than `width`, at a point or along an edge, are parts of their own afterwards, and
// components thinner than that are left out. Triangles that are thinner are taken out, and
// SolidOfMesh() separates what is left. TouchesTooFlatly() where that does not come to an end or
// would open the mesh; CANCELLED.
// Only triangles between vertices with `near_contact` 1 are looked at, by vertex; those at the end
// may be left out. So what is thin elsewhere stays.
absl::StatusOr<SeparatedSolids> SeparateContacts(TriangleMesh mesh,
                                                 std::vector<uint8_t> near_contact, double width,
                                                 const RunContext& context);

}  // namespace rilievo
