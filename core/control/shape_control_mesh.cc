#include "core/control/shape_control_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/control/creases/feature_planes.h"
#include "core/control/creases/tag_creases.h"
#include "core/control/settings.h"
#include "core/control/simplify/adaptive_simplify.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/simplify/uncovered_points.h"

namespace rilievo {

absl::StatusOr<ControlMesh> ShapeControlMesh(ControlMesh shape, const OrientedCloud& cloud,
                                             const PointIndex& index, CreaseRule creases,
                                             int target_faces, double border_weight,
                                             const RunContext& context) {
  const SimplifyOptions simplify{.target_faces = std::max(target_faces, 4),
                                 .boundary_weight = border_weight};
  // Few enough faces to look at the points beside each that bends.
  const SimplifyOptions to_fine{
      .target_faces = std::max(kShapeControlMesh.finer_than_control * target_faces, 4),
      .unordered_until = kShapeControlMesh.unordered_fine};
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh fine,
                           SimplifyMesh(std::move(shape), to_fine, context));
  FacePlanes planes;
  const bool find_creases = creases == CreaseRule::kAuto && fine.creases.empty();
  if (find_creases && !IsLeftOut(Mechanism::kFeaturePlanes)) {
    RILIEVO_ASSIGN_OR_RETURN(planes, FeaturePlanes(cloud, index, fine, context));
  }
  const auto simplified = [&](const UncoveredPoints& lost) -> absl::StatusOr<ControlMesh> {
    RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh,
                             AdaptiveSimplify(lost, fine, simplify, context, planes));
    ImproveShape(&mesh);
    if (find_creases && !IsLeftOut(Mechanism::kCreases)) {
      RILIEVO_RETURN_IF_ERROR(TagCreases(cloud, index, context, &mesh));
    }
    return mesh;
  };
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh control, simplified({}));
  const ShapeControlMeshSettings& of = kShapeControlMesh;
  const CoverageLimits in_reach = {of.covered_spacings, of.covered_noises, of.covered_cosine};
  RILIEVO_ASSIGN_OR_RETURN(const UncoveredPoints lost,
                           FindUncoveredPoints(cloud, control, in_reach, context));
  if (!lost.points.empty() && !IsLeftOut(Mechanism::kUncoveredPoints)) {
    RILIEVO_ASSIGN_OR_RETURN(control, simplified(lost));
  }
  return control;
}

}  // namespace rilievo
