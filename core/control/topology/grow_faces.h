// Faces that a control mesh gets where it had none.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct GrownFaces {
  std::vector<std::array<int, 3>> triangles;  // over vertices of the mesh
  std::vector<std::pair<int, int>> rims;  // the edges where they join its faces, lower end first
};

// Adds them behind the faces of `mesh`, cut to about the length of the edges of their rims and
// evened out, so that there are about a quarter as many as faces before at most. Vertices below
// `kept_vertices`, creases and corners keep their numbers and places, but flat edges may be
// flipped. The mesh is an oriented manifold with them. CANCELLED when stopped.
absl::StatusOr<ControlMesh> GrowFaces(ControlMesh mesh, int kept_vertices, const GrownFaces& grown,
                                      const RunContext& context);

}  // namespace rilievo
