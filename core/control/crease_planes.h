// Two planes against one quadric: whether the points around an edge say that it is sharp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// Outward unit normal, and offset: points x with normal . x = offset.
struct SidePlane {
  Eigen::Vector3d normal;
  double offset = 0;
};

// Of the points around a place on the edge, unit frame.
struct CreasePlanes {
  std::array<SidePlane, 2> sides;
  Eigen::Vector3d at;         // on the line where the planes meet, nearest to the place
  Eigen::Vector3d direction;  // unit, along that line
  double cosine = 1;          // between the sides' normals
  // Twice the logarithm of how much likelier the points are off two planes than off a quadric.
  double evidence = 0;
  double spacing = 0;  // of the points
};

// Where an edge of the control mesh may be sharp.
struct EdgePlace {
  Eigen::Vector3d middle;
  Eigen::Vector3d along;                  // unit
  std::array<Eigen::Vector3d, 2> normal;  // of the faces on either side
  std::array<Eigen::Vector3d, 2> inward;  // from the edge into them, within their planes
};

// Nothing where the points do not form two sides of enough of them, wide enough to hold a plane.
std::optional<CreasePlanes> FitCreasePlanes(const OrientedCloud& cloud, const PointIndex& index,
                                            const EdgePlace& place);

}  // namespace rilievo
