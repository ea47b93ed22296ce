// Creases of an exact triangle mesh: edges where its faces meet sharply.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Tags the edges of `*mesh` whose faces meet at 30 degrees or more, and those at 15 or more that a
// crease runs on along, where they form lines: beside them the mesh must bend much less. Vertices
// where a line turns sharply become corners. A mesh most of whose sharp edges form no lines, such
// as one of few triangles or a noisy one, stays untagged. `spacing`: bends and runs shorter than
// this are not looked at; unit frame. INVALID_ARGUMENT for a mesh that is not a manifold; CANCELLED
// after a stop request.
absl::Status TagSharpEdges(double spacing, const RunContext& context, ControlMesh* mesh);

}  // namespace rilievo
