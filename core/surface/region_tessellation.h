// A part of a surface without the rest.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct RegionMesh {
  TriangleMesh mesh;          // scan frame
  std::vector<int> vertices;  // of the level, ascending: the vertex that each column is
};

// The triangles of some control faces at one level, with their vertices and normals bit for bit as
// Tessellate() gives them: parts taken one by one fit without a crack. Work and memory follow the
// part and what touches it, but for the connectivity of the control mesh. `control_faces`:
// ascending, each once. level in [0, max_level]. INVALID_ARGUMENT for other faces or another level,
// or a surface that Tessellate() refuses.
absl::StatusOr<RegionMesh> TessellateRegion(const DisplacedSurface& surface,
                                            std::span<const int> control_faces, int level,
                                            const RunContext& context);

}  // namespace rilievo
