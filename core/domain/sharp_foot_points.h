// Foot points of creases and corners: a sample there belongs to all of its sides at once.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "core/domain/domain_samples.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The sum over a sharp sample's sides of m m^T, m the unit normal, by its axes: column k of `axes`
// has the eigenvalue `strength[k]`, descending. On a crease the last axis runs along it.
struct SideAxes {
  Eigen::Matrix3d axes;
  Eigen::Vector3d strength;
};
SideAxes AxesOfSides(const DomainSamples& samples, const SampledSurface& surface, int sample);

struct SharpFootPoint {
  Eigen::Vector3d move;  // from the sample to where the sides' points meet, across the crease
  double spacing = 0;    // of the points
  SideAxes sides;        // of the surface there
};

// `points`: of the cloud, in any number and order; each counts for the side whose normal is nearest
// to its own. Nothing unless at least two sides have points.
std::optional<SharpFootPoint> FindSharpFootPoint(const OrientedCloud& cloud,
                                                 std::span<const int> points,
                                                 const DomainSamples& samples,
                                                 const SampledSurface& surface, int sample);

}  // namespace rilievo
