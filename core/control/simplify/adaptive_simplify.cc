#include "core/control/simplify/adaptive_simplify.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// A collapse that makes edges of length h costs h^6: an area h^2 times a squared distance h^4. So
// this weight halves them, which makes four faces of one.
constexpr float kWeight = 64;

// Weighs the faces of `mesh` around `points` more.
absl::Status AddWeightsAround(const std::vector<Eigen::Vector3d>& points, const ControlMesh& mesh,
                              const RunContext& context, std::vector<float>* weights) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Build(mesh.vertices, mesh.faces, context));
  // The faces nearest to them, and a ring of faces around these.
  std::vector<uint8_t> touched(static_cast<size_t>(mesh.vertices.cols()));
  int hint = -1;
  for (const Eigen::Vector3d& point : points) {
    hint = tree.Closest(point, hint).item;
    for (const int v : mesh.faces.col(tree.source()[hint])) touched[v] = 1;
  }
  weights->resize(static_cast<size_t>(mesh.faces.cols()), 1.0f);
  for (size_t f = 0; f < weights->size(); ++f) {
    const auto corners = mesh.faces.col(static_cast<Eigen::Index>(f));
    if (std::any_of(corners.begin(), corners.end(), [&](int v) { return touched[v] != 0; })) {
      (*weights)[f] *= kWeight;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> AdaptiveSimplify(const UncoveredPoints& lost, const ControlMesh& fine,
                                             const SimplifyOptions& options,
                                             const RunContext& context, FacePlanes planes) {
  SimplifyOptions with_more = options;
  if (!lost.points.empty()) {
    RILIEVO_RETURN_IF_ERROR(AddWeightsAround(lost.points, fine, context, &planes.weights));
    with_more.target_faces += 3 * lost.faces;
  }
  return SimplifyMesh(fine, with_more, context, &planes);
}

}  // namespace rilievo
