// The result: a Loop or Catmull-Clark surface over a control mesh, plus one height per vertex along
// its normal.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/rgb.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/refinement.h"
#include "core/surface/height_source.h"

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
  std::vector<Rgb> colors = {};       // same size, or empty
};

// The displaced vertices of one level with their triangles and normals, in the scan frame.
// level in [0, max_level + 2]. Above max_level the limit surface is still exact, and heights are
// interpolated: by the butterfly's 8-point rule (Dyn, Levin, Gregory 1990) on edges whose whole
// stencil exists, by the mean of the ends elsewhere. INVALID_ARGUMENT for another level, or when
// the number of heights does not fit the control mesh. Normals are those of the displaced
// triangles, area-weighted.
absl::StatusOr<TriangleMesh> Tessellate(const DisplacedSurface& surface, int level,
                                        const RunContext& context);
// The same in the unit frame, with or without normals; to make them takes as much memory as the
// rest.
absl::StatusOr<TriangleMesh> TessellateInUnitFrame(const DisplacedSurface& surface, int level,
                                                   bool with_normals, const RunContext& context);

// The vertices of level max_level in the unit frame, column = vertex: where each one is, and what
// displaces it from the limit surface: its height times its limit normal. INVALID_ARGUMENT as
// Tessellate().
struct DisplacedVertices {
  Eigen::Matrix3Xd positions, displacements;
};
absl::StatusOr<DisplacedVertices> DisplaceVertices(const DisplacedSurface& surface,
                                                   const RunContext& context);

// Height of each vertex of that tessellation, from surface.max_level and surface.heights alone.
// `refinement` reaches `level`, or the level before it.
std::vector<float> HeightsAtLevel(const DisplacedSurface& surface, const LoopRefinement& refinement,
                                  int level);

// Height source of each vertex of that tessellation. An interpolated height has the less trusted
// source of the two ends of its edge. Empty where Tessellate would fail.
std::vector<HeightSource> SourcesAtLevel(const DisplacedSurface& surface, int level);

// Colour of each vertex of that tessellation; a new vertex above max_level has the mean of the ends
// of its edge. Empty where the surface has no colours or Tessellate would fail.
std::vector<Rgb> ColorsAtLevel(const DisplacedSurface& surface, int level);

// Appends the colours of the new vertices, one an edge of `topology`: the means of the edges' ends.
void AppendMeanColors(const MeshTopology& topology, std::vector<Rgb>* colors);

}  // namespace rilievo
