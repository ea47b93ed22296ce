// The point of a displaced surface that is nearest to a place, with its parameter.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/evaluate/displaced_evaluator.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

struct ClosestPoint {
  int face = 0;                                        // control face
  double u = 0, v = 0;                                 // on it
  double distance = 0;                                 // scan unit
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // scan frame; At(face, u, v) has the same
};

// The nearest point of the flat triangles of the finest level is found exactly; from there Newton
// steps move the foot along the surface of DisplacedEvaluator, from triangle to triangle where need
// be, and stop at creases. So the distance is the least one of the surface, unless two parts of it
// lie equally far off but for what it bends over a finest triangle.
class ClosestPointFinder {
 public:
  // Errors as DisplacedEvaluator::Build().
  static absl::StatusOr<ClosestPointFinder> Build(const DisplacedSurface& surface,
                                                  const RunContext& context);

  const DisplacedEvaluator& evaluator() const { return evaluator_; }

  // `places`: finite, scan frame, a column each, in any order. The same for any number of threads.
  absl::StatusOr<std::vector<ClosestPoint>> Find(const Eigen::Matrix3Xd& places,
                                                 const RunContext& context) const;

 private:
  struct Foot {
    DisplacedEvaluator::FinestTriangle at;
    Eigen::Vector3d weights;  // of the triangle's corners
  };
  Foot FootOnTriangles(const Eigen::Vector3d& place, int* hint) const;
  // `place`: unit frame.
  Foot Polish(const Eigen::Vector3d& place, Foot foot) const;
  // The same place on the triangle across the edge opposite a corner; `corner` becomes the one
  // opposite the edge there. False on a boundary.
  bool Cross(int* corner, Foot* foot) const;
  bool CrossControlEdge(int* corner, Foot* foot) const;

  DisplacedEvaluator evaluator_;
  MeshTopology control_;
  ClosestPointTree tree_;
  Eigen::Matrix3Xd vertices_;  // of the finest level, unit frame
  Eigen::Matrix3Xi triangles_;
  // Those of one control face, in the order of `triangles_`.
  std::vector<DisplacedEvaluator::FinestTriangle> lattice_;
};

}  // namespace rilievo
