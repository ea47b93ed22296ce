#include "core/control/shape_control_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/control/creases/feature_planes.h"
#include "core/control/creases/tag_creases.h"
#include "core/control/simplify/adaptive_simplify.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/simplify/uncovered_points.h"

namespace rilievo {
namespace {

// Seven of eight of its faces go later, in order: down to it blocks serve.
constexpr double kUnorderedFine = 1;

// Where the control mesh is simplified once more. Of nine clean shapes the largest errors came to
// .88 of those with 1 spacing and a cosine of .3, with .4 spacings to .83; that was not tried on
// thin walls.
constexpr CoverageLimits kInReach = {.spacings = 0.6, .noises = 3, .cosine = 0.6};

}  // namespace

absl::StatusOr<ControlMesh> ShapeControlMesh(ControlMesh shape, const OrientedCloud& cloud,
                                             const PointIndex& index, CreaseRule creases,
                                             int target_faces, int most_faces, double border_weight,
                                             const RunContext& context) {
  const SimplifyOptions simplify{.target_faces = std::max(target_faces, 4),
                                 .boundary_weight = border_weight};
  // Few enough faces to look at the points beside each that bends.
  const SimplifyOptions to_fine{.target_faces = std::max(kFinerThanControl * target_faces, 4),
                                .unordered_until = kUnorderedFine};
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh fine,
                           SimplifyMesh(std::move(shape), to_fine, context));
  FacePlanes planes;
  const bool find_creases = creases == CreaseRule::kAuto && fine.creases.empty();
  if (find_creases && !IsLeftOut(Mechanism::kFeaturePlanes)) {
    RILIEVO_ASSIGN_OR_RETURN(planes, FeaturePlanes(cloud, index, fine, context));
  }
  const auto simplified = [&](const UncoveredPoints& lost) -> absl::StatusOr<ControlMesh> {
    RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh,
                             AdaptiveSimplify(lost, fine, simplify, most_faces, context, planes));
    ImproveShape(&mesh);
    if (find_creases && !IsLeftOut(Mechanism::kCreases)) {
      RILIEVO_RETURN_IF_ERROR(TagCreases(cloud, index, context, &mesh));
    }
    return mesh;
  };
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh control, simplified({}));
  RILIEVO_ASSIGN_OR_RETURN(const UncoveredPoints lost,
                           FindUncoveredPoints(cloud, control, kInReach, context));
  if (!lost.points.empty() && !IsLeftOut(Mechanism::kUncoveredPoints)) {
    RILIEVO_ASSIGN_OR_RETURN(control, simplified(lost));
  }
  return control;
}

}  // namespace rilievo
