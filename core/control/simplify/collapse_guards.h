// The shape of the faces around an edge, before and after its collapse.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/control/simplify/half_edge_mesh.h"

namespace rilievo {

// 1 for an equilateral triangle, 0 for a degenerate one; `cross` spans twice the area.
double Roundness(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                 const Eigen::Vector3d& cross);

// Whether no face around vertex `v` turns so far or farther as it moves to `moved`.
bool KeepsFacesUpright(const Eigen::Matrix3Xd& vertices, const HalfEdgeMesh& mesh, int v,
                       const Eigen::Vector3d& moved);

// A mesh as a collapse finds it; all is kept by reference.
class CollapseGuards {
 public:
  // `reference_normals`: of each face, that the faces made keep to, no further off than an angle
  // of this cosine, in [0, 1).
  CollapseGuards(const HalfEdgeMesh& mesh, const std::vector<Eigen::Vector3d>& positions,
                 const std::vector<Eigen::Vector3f>& reference_normals, double least_turn_cosine)
      : mesh_(mesh),
        positions_(positions),
        reference_normals_(reference_normals),
        least_turn_cosine_(least_turn_cosine) {}

  // Whether the faces that stay around edge a-b keep upright when both ends move to `position`, and
  // the worst of them is as round (1: equilateral) as asked or as it was.
  bool KeepShape(int a, int b, const Eigen::Vector3d& position, double roundness) const;

 private:
  struct Worst {
    double before = 1, after = 1;  // roundness
    bool upright = true;
  };

  void Inspect(int vertex, int other, const Eigen::Vector3d& position, Worst* worst) const;
  // Whether no face around `vertex` comes near to what is asked of it; told by squares, for less
  // than half of what Inspect() takes.
  bool ClearlyKeepShape(int vertex, int other, const Eigen::Vector3d& position,
                        double roundness) const;

  const HalfEdgeMesh& mesh_;
  const std::vector<Eigen::Vector3d>& positions_;
  const std::vector<Eigen::Vector3f>& reference_normals_;
  const double least_turn_cosine_;
};

}  // namespace rilievo
