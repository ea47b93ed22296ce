#include "core/control/simplify/adaptive_simplify.h"

#include <cstdint>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/simplify/settings.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// The weights of the faces of `mesh`: those nearest to `points`, and a ring of faces around these,
// count more.
absl::StatusOr<std::vector<float>> WeightsAround(const std::vector<Eigen::Vector3d>& points,
                                                 const ControlMesh& mesh,
                                                 const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Over(mesh.vertices, mesh.faces, context));
  std::vector<uint8_t> touched(static_cast<size_t>(mesh.vertices.cols()));
  int hint = -1;
  for (const Eigen::Vector3d& point : points) {
    hint = tree.Closest(point, hint).item;
    for (const int v : mesh.faces.col(tree.source()[hint])) touched[v] = 1;
  }
  std::vector<float> weights(static_cast<size_t>(mesh.faces.cols()), 1.0f);
  for (size_t f = 0; f < weights.size(); ++f) {
    for (const int v : mesh.faces.col(static_cast<Eigen::Index>(f))) {
      if (touched[v] != 0) weights[f] = kAdaptiveSimplify.weight;
    }
  }
  return weights;
}

}  // namespace

absl::StatusOr<ControlMesh> AdaptiveSimplify(const UncoveredPoints& lost, const ControlMesh& fine,
                                             const SimplifyOptions& options,
                                             const RunContext& context, FacePlanes planes) {
  SimplifyOptions with_more = options;
  if (!lost.points.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(planes.weights, WeightsAround(lost.points, fine, context));
    with_more.target_faces += 3 * lost.faces;
  }
  return SimplifyMesh(fine, with_more, context, &planes);
}

}  // namespace rilievo
