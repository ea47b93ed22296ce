// On which side of a mesh a place lies, and how far off.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

// Distances are exact; the sign is that of the pseudonormal at the nearest point: of the triangle,
// of both triangles of an edge, or of those of a vertex by their angles (Baerentzen and Aanaes
// 2005), which is right wherever the mesh is closed and does not meet itself. Positive outside; of
// an open mesh on the side that its triangles face.
class SignedDistance {
 public:
  // `children_per_face`: as for ClosestPointTree. INVALID_ARGUMENT without triangles, or where a
  // coordinate is not finite.
  static absl::StatusOr<SignedDistance> Build(TriangleMesh mesh, int children_per_face,
                                              const RunContext& context);

  // One for each column. A place that is not finite has a distance that is not a number. Quickest
  // where neighbours are near each other.
  absl::StatusOr<std::vector<double>> Of(const Eigen::Matrix3Xd& places,
                                         const RunContext& context) const;

 private:
  // 0 inside of the triangle, else the pseudonormal of its edge or vertex.
  Eigen::Vector3d NormalAt(int triangle, const Eigen::Vector3d& weights) const;

  TriangleMesh mesh_;
  ClosestPointTree tree_;
  Eigen::Matrix3Xd triangle_normals_;  // unit
  Eigen::Matrix3Xd edge_normals_;      // column = half-edge (half_edges.h)
  Eigen::Matrix3Xd vertex_normals_;
};

}  // namespace rilievo
