#include "core/control/simplify_in_reach.h"

#include <cstdint>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/out_of_reach.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// A collapse that makes edges of length h costs h^6: an area h^2 times a squared distance h^4. So
// this weight halves them, which makes four faces of one.
constexpr float kWeight = 64;
constexpr int kMoreFaces = 3;
constexpr int kRings = 2;  // of faces around those nearest to a point out of reach

// The face of `mesh` nearest to each of the points, and kRings of faces around it: 1; others: 0.
absl::StatusOr<std::vector<uint8_t>> FacesAround(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const std::vector<int>& points,
                                                 const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Build(mesh.vertices, mesh.faces, context));
  std::vector<uint8_t> near(static_cast<size_t>(mesh.faces.cols()));
  int hint = -1;
  for (const int point : points) {
    hint = tree.Closest(cloud.points.col(point), hint).item;
    near[tree.source()[hint]] = 1;
  }
  for (int ring = 0; ring < kRings; ++ring) {
    std::vector<uint8_t> touched(static_cast<size_t>(mesh.vertices.cols()));
    for (size_t f = 0; f < near.size(); ++f) {
      if (near[f] == 0) continue;
      for (const int v : mesh.faces.col(static_cast<Eigen::Index>(f))) touched[v] = 1;
    }
    for (size_t f = 0; f < near.size(); ++f) {
      for (const int v : mesh.faces.col(static_cast<Eigen::Index>(f))) near[f] |= touched[v];
    }
  }
  return near;
}

}  // namespace

absl::StatusOr<ControlMesh> SimplifyInReach(const ControlMesh& fine, const SimplifyOptions& options,
                                            const OrientedCloud& cloud, const RunContext& context,
                                            FacePlanes planes) {
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh control, SimplifyMesh(fine, options, context, &planes));
  RILIEVO_ASSIGN_OR_RETURN(const OutOfReach lost, FindOutOfReach(cloud, control, context));
  if (lost.points.empty()) return control;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> near,
                           FacesAround(fine, cloud, lost.points, context));
  planes.weights.assign(near.size(), 1.0f);
  for (size_t f = 0; f < near.size(); ++f) {
    if (near[f] != 0) planes.weights[f] = kWeight;
  }
  SimplifyOptions again = options;
  again.target_faces += kMoreFaces * lost.faces;
  return SimplifyMesh(fine, again, context, &planes);
}

}  // namespace rilievo
