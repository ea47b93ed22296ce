// The folds of a surface, all of it at once.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/base/run_context.h"
#include "core/loop/refinement.h"
#include "core/surface/count_folds.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

inline int64_t CountFolds(DisplacedSurface surface) {
  surface.frame = {};
  const RunContext context;
  const int level = surface.max_level;
  const TriangleMesh mesh = Tessellate(surface, level, context).value();
  const LoopRefinement refinement =
      RefineTopology(surface.control_mesh, std::max(0, level - 1), context).value();
  const LimitSurface limit =
      EvaluateLimit(refinement, surface.control_mesh.vertices, level, context).value();
  return CountFolds(limit, mesh.vertices, mesh.triangles, context).value();
}

}  // namespace rilievo
