// The edges of a mesh over its picture.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "client/picture/camera.h"
#include "client/picture/raster.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Dark lines about a pixel wide along the edges that lie on what the raster shows, or in front of
// it. `at`: the mesh's vertices on the raster.
absl::Status DrawEdges(const TriangleMesh& mesh, const std::vector<Projected>& at,
                       const Projection& projection, const RunContext& context, Raster* raster);

}  // namespace rilievo
