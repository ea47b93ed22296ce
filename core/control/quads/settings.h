// Settings of control/quads.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct ImproveQuadsSettings {
  // A turn for the valences may leave its quads this square, or as square as they were.
  double square_enough = 0.4;
  // A turn that leaves the valences as good as they were must make the worse quad this much
  // squarer.
  double squarer = 1.25;
  // The cosine between the normals of two quads that share an edge which is turned.
  double least_cosine = 0.75;
  // The cosine between the normals of a quad that takes the place of two and of these.
  double least_cosine_of_left = 0.5;
  // Squared valences that a flat corner is worth.
  int flat_corner_valence = 6;
};
RILIEVO_SETTINGS ImproveQuadsSettings kImproveQuads;

struct PairTrianglesSettings {
  // Of one squared valence beside the squareness of a quad, which is 1 at most.
  double valence_weight = 0.1;
  // Of a flat corner, in squared valences.
  double flat_corner = 4;
  // Steps across a smooth edge that crossing a crease, and ending at the boundary, are worth.
  double crease_steps = 8, boundary_steps = 4;
  double least_squareness = 0.1;  // of a quad
  int most_ways = 100;            // along which a triangle looks for another one to pair with
};
RILIEVO_SETTINGS PairTrianglesSettings kPairTriangles;

struct PolygonSetSettings {
  double flat_cosine = -0.5;  // between the edges at a corner: below it the corner is flat
};
RILIEVO_SETTINGS PolygonSetSettings kPolygonSet;

}  // namespace rilievo
