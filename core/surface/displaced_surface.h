// The result: a Loop surface over a control mesh, plus one height per vertex along its normal.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/height_source.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Point of vertex v of level `max_level`: limit_position(v) + heights[v] * limit_normal(v), unit
// frame, then frame.ScanFromUnit. Vertices nest (loop/refinement.h), so the first V_l heights are
// the heights of level l.
struct DisplacedSurface {
  SpatialFrame frame;
  ControlMesh control_mesh;
  int max_level = 0;
  std::vector<float> heights;         // unit frame, one per vertex of max_level
  std::vector<HeightSource> sources;  // same size
};

// The displaced vertices of one level with their triangles and normals, in the scan frame.
// level in [0, max_level + 2]: above max_level heights are interpolated. INVALID_ARGUMENT
// otherwise. Normals are those of the displaced triangles, area-weighted.
absl::StatusOr<TriangleMesh> Tessellate(const DisplacedSurface& surface, int level,
                                        const RunContext& context);

// Height source of each vertex of that tessellation.
std::vector<HeightSource> SourcesAtLevel(const DisplacedSurface& surface, int level);

}  // namespace rilievo
