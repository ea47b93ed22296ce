#include "core/pipeline/measure_faces.h"

#include <cstddef>
#include <cstdint>

#include "core/base/status_macros.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

DisplacementField NoHeights(int64_t vertices) {
  DisplacementField field;
  field.heights.assign(static_cast<size_t>(vertices), 0.0f);
  field.source.assign(static_cast<size_t>(vertices), HeightSource::kFilled);
  return field;
}

}  // namespace

absl::StatusOr<HeightsOfFaces> MeasureFaces(const SubMesh& sub, const std::vector<int>& inner,
                                            const OrientedCloud& cloud, int level,
                                            const DisplacementOptions& options,
                                            const RunContext& context) {
  const ControlMesh& mesh = sub.mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineToVertices(mesh, level, context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, mesh.vertices, level, context));
  DisplacementField field = NoHeights(limit.positions.cols());
  if (cloud.points.cols() > 0) {
    const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
    const LevelRings rings =
        level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
    RILIEVO_ASSIGN_OR_RETURN(field,
                             SampleDisplacement(cloud, refinement, rings, limit, options, context));
  }
  const FaceVertices vertices(refinement.levels.front(), level);
  HeightsOfFaces found;
  found.leverage = field.leverage;
  std::vector<int> of_face;
  for (const int f : inner) {
    vertices.Of(f, of_face);
    for (const int v : of_face) {
      found.heights.push_back(field.heights[v]);
      found.sources.push_back(field.source[v]);
    }
  }
  return found;
}

}  // namespace rilievo
