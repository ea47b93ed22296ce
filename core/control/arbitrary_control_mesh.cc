#include "core/control/arbitrary_control_mesh.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/control/implicit/implicit_function.h"
#include "core/control/implicit/marching_cubes.h"
#include "core/control/settings.h"
#include "core/control/shape_control_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/topology/mesh_subset.h"
#include "core/control/topology/remove_handles.h"
#include "core/control/topology/trim_surface.h"

namespace rilievo {
namespace {

// A zero set and the finest cell of its function, unit frame.
struct ZeroSet {
  ControlMesh mesh;
  double finest_cell = 0;
};

// Of a function of the cloud, whose normals take the sides that it found.
absl::StatusOr<ZeroSet> FindZeroSet(NeighborGraph graph, const PointIndex& index,
                                    BoundaryRule boundary, const RunContext& context,
                                    OrientedCloud* cloud) {
  ImplicitOptions options;
  options.closed = boundary == BoundaryRule::kClose;
  RILIEVO_ASSIGN_OR_RETURN(const ImplicitFunction function,
                           FitImplicitFunction(*cloud, std::move(graph), index, options, context));
  for (size_t i = 0; i < function.sides.size(); ++i) {
    if (function.sides[i] < 0) cloud->normals.col(static_cast<int64_t>(i)) *= -1;
  }
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh, ExtractIsoSurface(function, context));
  return ZeroSet{std::move(mesh), function.finest_cell()};
}

}  // namespace

absl::StatusOr<ArbitraryMesh> ArbitraryControlMesh(OrientedCloud cloud, NeighborGraph graph,
                                                   const PointIndex& index, BoundaryRule boundary,
                                                   CreaseRule creases, int target_faces,
                                                   const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ZeroSet zero_set,
                           FindZeroSet(std::move(graph), index, boundary, context, &cloud));
  context.Report(Stage::kControlMesh, 0.5);
  zero_set.mesh = SplitFans(zero_set.mesh).mesh;
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh trimmed,
                           TrimSurface(zero_set.mesh, cloud, index, boundary, context));
  zero_set.mesh = ControlMesh();
  if (trimmed.faces.cols() == 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "no surface was found in the ", cloud.points.cols(),
        " points: they do not lie densely enough on one; topology user takes a control mesh of "
        "your own"));
  }
  context.Report(Stage::kControlMesh, 0.6);
  const double unit = std::max(cloud.share_of_spacing * cloud.median_spacing, zero_set.finest_cell);
  // Searched at about the density of the points: a finer mesh would only cost time.
  const SimplifyOptions to_points{
      .target_faces = std::max(static_cast<int>(cloud.points.cols()), 4 * target_faces)};
  if (trimmed.faces.cols() > kArbitraryControlMesh.handle_search_share * to_points.target_faces) {
    RILIEVO_ASSIGN_OR_RETURN(trimmed, SimplifyMesh(std::move(trimmed), to_points, context));
  }
  const LoopSupport support(cloud, index);
  const HandleLengths searches[] = {
      {.longest = unit * kArbitraryControlMesh.small_handle,
       .tiny = unit * kArbitraryControlMesh.small_handle / 2},
      {.longest = unit * kArbitraryControlMesh.small_handle * 2, .tiny = 0},
  };
  RILIEVO_ASSIGN_OR_RETURN(HandleRemoval clean,
                           RemoveHandles(std::move(trimmed), searches, &support, context));
  RILIEVO_ASSIGN_OR_RETURN(
      ControlMesh control,
      ShapeControlMesh(std::move(clean.mesh), cloud, index, creases, target_faces,
                       SimplifyOptions().boundary_weight, context));
  return ArbitraryMesh{std::move(control), std::move(cloud)};
}

}  // namespace rilievo
