// Small displaced surfaces for the writers.
#pragma once

#include <cmath>

#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"

namespace rilievo::testing {

// An octahedron with a crease around its equator, half of it semi-sharp, a corner at its top, and
// heights that differ at every vertex.
inline DisplacedSurface CreasedOctahedron(int max_level) {
  DisplacedSurface surface;
  surface.frame = {Eigen::Vector3d(4.6e6, 5.5e6, 300), 8.0};
  surface.control_mesh.vertices.resize(3, 6);
  surface.control_mesh.vertices << 1, 0, -1, 0, 0, 0,  //
      0, 1, 0, -1, 0, 0,                               //
      0, 0, 0, 0, 1, -1;
  surface.control_mesh.vertices *= 0.25;
  surface.control_mesh.faces.resize(3, 8);
  surface.control_mesh.faces << 0, 1, 2, 3, 1, 2, 3, 0,  //
      1, 2, 3, 0, 0, 1, 2, 3,                            //
      4, 4, 4, 4, 5, 5, 5, 5;
  surface.control_mesh.creases = {{0, 1, 10.0f}, {0, 3, 1.5f}, {1, 2, 10.0f}, {2, 3, 1.5f}};
  surface.control_mesh.corners = {4};
  surface.max_level = max_level;
  const int count =
      RefineTopology(surface.control_mesh, max_level, RunContext())->vertex_count(max_level);
  for (int v = 0; v < count; ++v) {
    surface.heights.push_back(static_cast<float>(0.01 * std::sin(0.7 * v) + 1e-6 * v));
    surface.sources.push_back(v % 3 == 0 ? HeightSource::kFilled : HeightSource::kMeasured);
  }
  return surface;
}

}  // namespace rilievo::testing
