// Two planes against one quadric: whether the points around an edge show that it is sharp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Outward unit normal, offset, and curvature along the edge, as the wall of a hole has: points x
// with normal . x = offset + curvature t^2 / 2, t along the edge from its middle.
struct HingePlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0;
  double curvature = 0;
};

// Of the points around a place on the edge, unit frame.
struct TwoPlaneModel {
  std::array<HingePlane, 2> sides;
  Eigen::Vector3d middle, along;  // of the edge
  Eigen::Vector3d at;             // on the line where the sides meet, nearest to the middle
  Eigen::Vector3d direction;      // unit, along that line
  double cosine = 1;              // between the sides' normals
  // Twice the logarithm of how much likelier the points are off two sides than off a quadric, less
  // what the sides' two curvatures cost (Schwarz 1978).
  double log_likelihood_ratio = 0;
  // How far inside their corner the points by the edge lie in the
  // mean, in standard errors: about 0 or less at a sharp edge, more at a rounded one.
  double bluntness = 0;
  double spacing = 0;  // of the points

  // The tangent plane of a side where it passes `place`, a place by the edge.
  HingePlane TangentAt(int side, const Eigen::Vector3d& place) const;
};

// Where an edge of the control mesh may be sharp.
struct EdgePlace {
  Eigen::Vector3d middle;
  Eigen::Vector3d along;                  // unit
  std::array<Eigen::Vector3d, 2> normal;  // of the faces on either side
  std::array<Eigen::Vector3d, 2> inward;  // from the edge into them, within their planes
};

// Nothing where the points do not form two sides of enough of them, wide enough to hold a plane, or
// lie farther off them than their noise.
std::optional<TwoPlaneModel> FitTwoPlaneModel(const OrientedCloud& cloud, const PointIndex& index,
                                              const EdgePlace& place);

}  // namespace rilievo
