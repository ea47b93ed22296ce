// A mesh cut finer, so that a control mesh can be simplified out of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// `mesh`, a manifold without creases, with no edge longer than `longest` (> 0; frame of the mesh):
// in rounds the longest edge of each triangle is halved where it is longer, with the longest edges
// of the triangles beside it (Rivara, Algorithms for refining triangular grids suitable for
// adaptive and multigrid techniques, 1984). Needles, of which a small area has any number of
// pieces, get about `most_pieces` together, and edges as long as that leaves them. A vertex where
// more than 64 triangles meet, such as the tip of a cone, gets rings around it, each of half as
// many edges as the one outside: a collapse there looks at all of them. RESOURCE_EXHAUSTED beyond
// 2^28 faces; CANCELLED when stopped.
absl::StatusOr<ControlMesh> SplitLongEdges(ControlMesh mesh, double longest, int64_t most_pieces,
                                           const RunContext& context);

// `mesh`, a manifold of triangles, with these edges halved, given by their ends, and with them the
// longest edges of the triangles at them, in turn (Rivara). Halves of creases are creases.
ControlMesh HalveEdges(const ControlMesh& mesh, const std::vector<std::array<int, 2>>& edges);

}  // namespace rilievo
