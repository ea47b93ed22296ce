// Whether the points of a scan support a loop on a mesh as part of the surface, or show a bridge.
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// Refers to a cloud of a point or more and the index of its points, which have to outlive it.
class LoopSupport {
 public:
  LoopSupport(const OrientedCloud& cloud, const PointIndex& index) : cloud_(cloud), index_(index) {}

  // Whether points line the loop of vertices: at least six of them go around it, and their normals
  // agree with those of the mesh to 25 degrees in the mean. So it is around a true rod or hole;
  // around a bridge between two sheets, or a hole through a thin one, normals of points stand
  // across those of the mesh. `vertices`, `normals`: of the mesh, unit frame.
  bool PointsLine(std::span<const int> loop, const Eigen::Matrix3Xd& vertices,
                  const Eigen::Matrix3Xd& normals) const;

  // Whether points lie by the loop, but not all over its inside and facing along its axis, as they
  // do where it is around a bridge between two sheets, or a hole torn through a thin wall. The
  // inside of a true hole is open, and points on a true rod face away from its axis; where there
  // are no points at all they say nothing. `vertices`: unit frame.
  bool PointsLeaveOpen(std::span<const int> loop, const Eigen::Matrix3Xd& vertices) const;

 private:
  const OrientedCloud& cloud_;
  const PointIndex& index_;
};

}  // namespace rilievo
