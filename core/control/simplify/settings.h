// Settings of control/simplify.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/ablation.h"

namespace rilievo {

struct AdaptiveSimplifySettings {
  // A collapse that makes edges of length h costs h^6: an area h^2 times a squared distance h^4. So
  // this weight halves them, which makes four faces of one.
  float weight = 64;
};
RILIEVO_SETTINGS AdaptiveSimplifySettings kAdaptiveSimplify;

struct CoarserControlMeshSettings {
  // Few faces have to follow curvature: 1e-4 took 1 to 5 % fewer bytes than the usual 1e-2.
  double evenness = 1e-4;
};
RILIEVO_SETTINGS CoarserControlMeshSettings kCoarserControlMesh;

struct CollapseGuardsSettings {
  // Faces flatter than this have no normal to speak of: only their turn in all is checked.
  double sliver_roundness = 0.02;
  // On squares, well above what rounding could hide.
  double clearly = 1 + 1e-6;
  // Least cosine between the normals of a face before and after one of its corners moves.
  double least_upright = 0.3;
};
RILIEVO_SETTINGS CollapseGuardsSettings kCollapseGuards;

struct CreaseConstraintsSettings {
  double least_turn_cosine = 0.5;  // cos 60 degrees
};
RILIEVO_SETTINGS CreaseConstraintsSettings kCreaseConstraints;

// What a collapse must leave behind.
struct CollapseGrade {
  double roundness;   // of the worst face around (1: equilateral), unless it was worse before
  int valence_slack;  // added to SimplifyOptions::max_valence
  int least_valence;  // of the two vertices opposite the edge
};
struct EdgeCollapserSettings {
  // A collapse refused under one grade comes back at `grade_cost` times its cost under the next: a
  // guard that is final would freeze regions full of slivers.
  std::array<CollapseGrade, 3> grades = {{{0.5, -1, 4}, {0.25, 0, 4}, {0.05, 0, 3}}};
  CollapseGrade coarse = {0.01, 3, 3};  // for faces that will not last
  int closed_floor = 20;                // faces a closed component keeps
  int open_floor = 8;                   // faces an open component keeps
  static constexpr int last_grade = 2;  // of these
  float grade_cost = 4;                 // see above
  // A factor in [1, 1 + jitter), always the same for an edge. Without it the flat parts of a
  // regular grid collapse in step and end as a lattice of rectangles, up to twice as long as wide.
  double jitter = 0.5;
};
RILIEVO_SETTINGS EdgeCollapserSettings kEdgeCollapser;

struct ImproveValenceSettings {
  // A flip for the valence may leave its faces this round (1: equilateral), or as round as they
  // were.
  double min_roundness = 0.5;
  // A flip that leaves the valences as good as they were must make the worse face this much
  // rounder.
  double rounder = 1.25;
};
RILIEVO_SETTINGS ImproveValenceSettings kImproveValence;

struct RelaxMeshSettings {
  // Pull to the neighbours' mean against the planes of the faces: holds a 90 degree crease to a few
  // hundredths of an edge and lets flat parts move freely.
  double pull = 0.01;
  int shape_rounds = 2, relax_rounds = 3;  // of valences, and of relaxation in each
};
RILIEVO_SETTINGS RelaxMeshSettings kRelaxMesh;

struct SimplifyMeshSettings {
  // A collapse is refused for what its neighbourhood was at the time: at each of these milestones,
  // in multiples of the target, all that are left are tried again.
  std::array<double, 8> milestones = {8.0, 4.0, 2.0, 1.4, 1.15, 1.03, 1.0, 1.0};
  // Far above the target, in multiples of it, the faces made will not last.
  double coarse_until = 3;
  // Vertices of a block. A tenth of them, at its rim, wait for the whole mesh's turn.
  int block_size = 8192;
  // Across edges that bend more than this a flip would change the shape.
  double flat_dihedral_degrees = 40;
};
RILIEVO_SETTINGS SimplifyMeshSettings kSimplifyMesh;

struct UncoveredPointsSettings {
  // The surface is looked at in triangles of level 2, of level 1 where that has more than these,
  // for their tree takes memory: as the fit does with its samples.
  int64_t most_triangles = 120'000;
  int interpolation_rounds = 3;  // that bring the limit to the vertices
  // More points than this a control face find nothing new.
  int64_t points_per_face = 32;
  // Noise carries single points that far with normals that are off too (1 to 4 of 100 000 points of
  // smooth scans); seldom so many of one face.
  int fewest_noisy = 2;
};
RILIEVO_SETTINGS UncoveredPointsSettings kUncoveredPoints;

}  // namespace rilievo
