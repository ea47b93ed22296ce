#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/control/control_roads.h"
#include "core/control/implicit_function.h"
#include "core/control/iso_surface.h"
#include "core/control/simplify_mesh.h"
#include "core/control/trim_surface.h"

namespace rilievo {

absl::StatusOr<ControlMesh> ArbitraryControlMesh(const OrientedCloud& cloud,
                                                 const NeighborGraph& graph,
                                                 const PointIndex& index, BoundaryRule boundary,
                                                 int target_faces, const RunContext& context) {
  ImplicitOptions implicit;
  implicit.closed = boundary == BoundaryRule::kClose;
  RILIEVO_ASSIGN_OR_RETURN(const ImplicitFunction function,
                           FitImplicitFunction(cloud, graph, implicit, context));
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh iso_surface, ExtractIsoSurface(function, context));
  context.Report(Stage::kControlMesh, 0.5);
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh trimmed,
                           TrimSurface(SplitPinchedVertices(iso_surface), cloud, index, boundary,
                                       TrimOptions{}, context));
  if (trimmed.faces.cols() == 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "no surface was found in the ", cloud.points.cols(),
        " points: they do not lie densely enough on one; the road user takes a control mesh of "
        "your own"));
  }
  context.Report(Stage::kControlMesh, 0.6);
  const SimplifyOptions simplify{.target_faces = std::max(target_faces, 4)};
  return SimplifyMesh(trimmed, simplify, context);
}

}  // namespace rilievo
