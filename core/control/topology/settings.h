// Settings of control/topology.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct BridgeGapsSettings {
  // Longer stretches are cut in two, at the middle of the first and what is nearest to it in the
  // middle half of the second, so that time stays linear.
  int most_stitched = 64;
  // Two stretches go together unless one is so many times as long as the other, and a gap more.
  double most_stretch = 3;
};
RILIEVO_SETTINGS BridgeGapsSettings kBridgeGaps;

struct CloseHolesSettings {
  // Edges of a rim for which the least area is searched for, in time with their cube.
  int most_searched = 1000;
};
RILIEVO_SETTINGS CloseHolesSettings kCloseHoles;

struct GrowFacesSettings {
  double share_of_faces = 0.25;                // new ones, of those there were
  int most_halvings = 30;                      // each halves the longest edge of nearly every face
  int fill_shape_rounds = 6, even_rounds = 5;  // of making a filling even; in each, of its vertices
  // Squared lengths of chords count so much beside the area of triangles that is to be least: in a
  // plane all that fill the same hole have the same.
  double short_chords = 0.01;
};
RILIEVO_SETTINGS GrowFacesSettings kGrowFaces;

struct LoopSupportSettings {
  double seen_spacings = 2;  // from a point to what it sees
  double seen = 0.5;         // share of the loop
  double covered = 0.7;      // share of the places within the loop
};
RILIEVO_SETTINGS LoopSupportSettings kLoopSupport;

struct RemoveHandlesSettings {
  int max_sweeps = 16;  // over all handles that are left
};
RILIEVO_SETTINGS RemoveHandlesSettings kRemoveHandles;

struct SurfaceSupportSettings {
  // Least cosine between a point's normal and that of what it supports; 0.58 at the corner of a
  // cube.
  double support_agreement = 0.4;
  // A point supports what lies within so many of its spacings or of its noise.
  double support_spacings = 1.6, support_noises = 4;
  double nearest_spacings = 0.9;  // a place with no point nearer, and ...
  double one_sided = 0.5;         // ... with points mostly on one side, lies beyond the border
  // What has no support within the surface is a hole that stays filled where it is at most this
  // wide, in spacings of the points around; wider ones are openings of the scan.
  double filled_hole_spacings = 10;
};
RILIEVO_SETTINGS SurfaceSupportSettings kSurfaceSupport;

struct TrimSurfaceSettings {
  // What wrong normals leave between two sheets is a bubble a few spacings wide.
  double fewest_of_piece = 25;
  int boundary_rounds = 4;  // of smoothing, where the surface was cut
  double least_of_all = 4;  // no scrap of fewer points is a surface, though the largest
};
RILIEVO_SETTINGS TrimSurfaceSettings kTrimSurface;

struct TrimUnmeasuredSettings {
  // A control face is looked at as so many triangles as two subdivisions make of it, and is
  // unmeasured when this share of their corners has no support.
  int level = 2;
  double unmeasured_share = 0.75;  // that share
  // From the middle of a gap, in its width, to vertices of its rims: these are half of it away, and
  // an edge between two may be as long.
  double reach_of_gap = 0.75;
};
RILIEVO_SETTINGS TrimUnmeasuredSettings kTrimUnmeasured;

}  // namespace rilievo
