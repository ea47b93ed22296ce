// Settings of scan/orientation.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct DipoleSettings {
  // Radii from which a group of dipoles counts as one.
  double far_radii = 2;
  double wider = 3;  // blur of a dipole, in that of its points
};
RILIEVO_SETTINGS DipoleSettings kDipole;

struct EdgeSignVotesSettings {
  double parallel_cosine = 0.8;  // from here on normals say most of each other
  double bent_worth = 0.5;       // the vote of two normals that are not parallel, of 1
  double undecided = 0.15;       // reflected cosine below which a vote fades
  double stair_worth = 0.2;      // the vote across a step, of 1
  // Parallel planes farther apart than this share of the spacing may be two sheets: below, scans
  // that do not quite meet look the same.
  double sheet_spacings = 0.4;
  // What votes across a wall are worth.
  double wall_worth = 0.8;
  // Of two sheets one lies over the other where the ways along them between their points cancel out
  // by more than this share, and else beside it.
  double all_around = 0.5;
};
RILIEVO_SETTINGS EdgeSignVotesSettings kEdgeSignVotes;

struct FlippedPatchesSettings {
  // A turned face may show the next one.
  int most_rounds = 2;
  // What a face gains by turning at least, per area and its radius, and the least share of the
  // votes on its rim that are for it. A flat one that is right would lose about one half; those
  // that were flipped gained 0.2 to 0.8 with 0.15 or more of the votes.
  double least_gain = 0.15;
  double least_votes = 0.1;  // that share
  // Share of the points in patches of few from which a face is not a surface: pins and leaves no
  // wider than the points are apart have 0.3, flipped faces 0.1 at most.
  double most_in_few = 0.2;
  double least_mean = 0.5;   // length of the mean normal of a scan that faces one way
  size_t most_faces = 1500;  // the agreements between them are held in a square
};
RILIEVO_SETTINGS FlippedPatchesSettings kFlippedPatches;

struct OrientNormalsSettings {
  double inside = 0.75;  // mean winding number of a group that lies within another
  // What a given normal weighs against a station: it may be wrong, and half as much is outvoted by
  // the neighbours of a single point.
  float normal_weight = 0.5F;
  double contested = 0.2;  // share of the votes against a group
};
RILIEVO_SETTINGS OrientNormalsSettings kOrientNormals;

struct OrientationPatchesSettings {
  double thicknesses = 1.5;  // of both patches: a step this high parts them
  double overlap = 0.6;      // of the radii together
  int largest_patch = 48;    // points
  double sure = 0.7;         // vote from which an edge joins patches by itself
  int levels = 1024;         // of sureness, in which edges are taken: the surest first
  double facing_votes = 2;   // what a point across a wall counts against neighbours
};
RILIEVO_SETTINGS OrientationPatchesSettings kOrientationPatches;

struct OutwardSignSettings {
  // Of closed surfaces the scans had 0.35 and more, under noise and with walls as thin as their
  // noise too; streets and terrain, open to the sky, 0.2 and less.
  double closed = 0.25;
  // Of the most volume that so large a sheet could span: a hemisphere spans more than half, a
  // street a fifth.
  double convex = 0.4;
};
RILIEVO_SETTINGS OutwardSignSettings kOutwardSign;

struct PatchDipolesSettings {
  // How far around a group, in its radii, another one counts.
  double reach = 4;
  // Most points of a leaf.
  static constexpr int leaf = 8;
  // Balances of votes that an agreement of 1 is worth: on simulated scenes 7 and 10 did as well.
  double worth = 10;
};
RILIEVO_SETTINGS PatchDipolesSettings kPatchDipoles;

struct SightVotesSettings {
  // A normal is of length 1 within this, which rounding to two digits keeps.
  double length_tolerance = 0.1;
  // Least shares of what is believed. Normals of another surface, or of none, have a median
  // |cosine| of 0.5; those of the same points from neighbourhoods of another size 0.97 or more,
  // under noise 0.9.
  double least_alignment = 0.75;
  // See ConsistencyOf: the stations of the simulated scenes reach at least 0.62 (a street of 20 000
  // points); a station that is wrongly placed outside a closed surface stays below 0.1.
  double least_share = 0.5;
};
RILIEVO_SETTINGS SightVotesSettings kSightVotes;

struct SignedGraphSettings {
  // By how much the links grow before the relation is asked again: that of large groups is dear.
  double growth = 1.05;
  // The balance of the links between two groups of nodes, the sum of their weights over that of the
  // sizes of these, from which it counts as sure: a tenth of the weight is against the rest.
  double sure_balance = 0.8;
};
RILIEVO_SETTINGS SignedGraphSettings kSignedGraph;

struct WindingNumberSettings {
  size_t leaf_points = 8;  // of a cell of the finest level
  size_t children = 4;     // of every other cell
};
RILIEVO_SETTINGS WindingNumberSettings kWindingNumber;

}  // namespace rilievo
