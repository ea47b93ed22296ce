// Where rays first meet a triangle mesh: a tree of boxes.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "tests/scans/ray_cast.h"

namespace rilievo {

class RayTree {
 public:
  // Keeps a reference to the mesh, of one triangle at least.
  explicit RayTree(const TriangleMesh& mesh);

  struct Hit {
    double distance;
    int triangle;
  };
  // The nearest triangle that the ray meets, from either side (Moeller and Trumbore 1997).
  std::optional<Hit> First(const Ray& ray) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int begin = 0, end = 0;  // of a leaf, in order_
    int second = 0;          // the second child of an inner node, whose first follows it; 0: a leaf
  };
  void Build(int begin, int end);

  const TriangleMesh& mesh_;
  Eigen::Matrix3Xd centers_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace rilievo
