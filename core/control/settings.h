// Settings of control.
#pragma once

#include <cstdint>
#include <numbers>

#include "core/base/ablation.h"

namespace rilievo {

struct ArbitraryControlMeshSettings {
  // Spacings around a handle four spacings wide; a loop of edges zigzags, and is longer than the
  // circle it follows by about 15 %. First those are looked for that are small enough to be noise,
  // then, twice as wide, those that bridge sheets or tear them.
  double small_handle = 4 * 1.15 * std::numbers::pi;
  double handle_search_share = 1.5;  // of what is small enough, the length that is searched
};
RILIEVO_SETTINGS ArbitraryControlMeshSettings kArbitraryControlMesh;

struct BuildControlMeshSettings {
  // Faces of the control mesh by default: as many points to each, up to the usual number of faces,
  // and from there on many points to each; never fewer than the fewest.
  int64_t points_per_face = 30, many_points_per_face = 120;
  int64_t fewest_faces = 200, usual_faces = 12000;  // see above
  // Points of which all count as telling, whatever their noise.
  int64_t telling_at_least = 20000;
  size_t stretch = 1024;             // of the curve, over which noise is taken to be even
  int64_t most_faces_per_point = 4;  // that may be asked for
};
RILIEVO_SETTINGS BuildControlMeshSettings kBuildControlMesh;

struct ChooseTopologySettings {
  // A height field makes a wall of every step, be it a roof's edge or a border in depth. Terrain
  // has none; on the airborne block of docs/accuracy.md they come to 8 % of the area, and the RMS
  // of a height field was 2.6 to 7 times that of an arbitrary mesh.
  double most_unseen_walls = 0.01;
  // A closed surface faces any plane with at most about half its area.
  double planar_facing = 0.8;
  // The octahedron spends its faces evenly over the directions: no loss against topology arbitrary
  // only where the surface is seen nearly head-on from the centre, at about one distance.
  double spherical_certain = 0.999;
  double spherical_radial = 0.99;       // share of points seen nearly head-on
  double spherical_radius_ratio = 2.0;  // of the farthest point to the nearest
};
RILIEVO_SETTINGS ChooseTopologySettings kChooseTopology;

struct ControlOptionsSettings {
  // Of the diagonal. A border as near to that of the mesh is exact, and so is a surface without
  // heights.
  double exact_border = 1e-5;
  double shortest_rim = 1e-6, longest_rim = 100;  // of holes to be closed, in diagonals
  double narrowest_gap = 1e-6, widest_gap = 1;    // of gaps to be bridged, in diagonals
  // The most that may be asked for or given.
  int most_control_faces = 200000;
};
RILIEVO_SETTINGS ControlOptionsSettings kControlOptions;

struct ShapeControlMeshSettings {
  // What covers a point where the control mesh is simplified once more. Of nine clean shapes the
  // largest errors came to .88 of those with 1 spacing and a cosine of .3, with .4 spacings to .83;
  // that was not tried on thin walls.
  double covered_spacings = 0.6, covered_noises = 3, covered_cosine = 0.6;
  // Of the faces of the fine mesh seven of eight go later, in order: down to as many as it has
  // blocks serve.
  double unordered_fine = 1;
  // Faces of the mesh whose bends are sharpened, in those of the control mesh.
  int finer_than_control = 8;
};
RILIEVO_SETTINGS ShapeControlMeshSettings kShapeControlMesh;

struct UserControlMeshSettings {
  double farthest = 10;           // diagonals
  double near = 0.25;             // of the diagonal
  double least_near_share = 0.5;  // of vertices near points, and of points near vertices
  // The fit holds the stencils of a face's vertices densely: their cost grows with the square of
  // the valence.
  int most_valence = 64;
};
RILIEVO_SETTINGS UserControlMeshSettings kUserControlMesh;

}  // namespace rilievo
