// Solids that only touch, taken apart.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// `mesh`, an oriented 2-manifold without boundary. Parts of it that hang together through necks
// narrower than `width`, at a point or along an edge, are parts of their own afterwards, and
// components thinner than that are left out. Triangles that are thinner are taken out, and
// SolidOfMesh() separates what is left. Where that would open the mesh, it stays as it is. Without
// triangles: nothing was left. CANCELLED.
// `at_cut`: by vertex, 1 where one solid's edge met a face of the other; empty: nowhere.
absl::StatusOr<TriangleMesh> SeparateContacts(TriangleMesh mesh, std::vector<uint8_t> at_cut,
                                              double width, const RunContext& context);

}  // namespace rilievo
