// Settings of control/creases.
#pragma once

#include <numbers>

#include "core/base/ablation.h"

namespace rilievo {

struct ClassifyEdgesSettings {
  // Twice the log-likelihood ratio from which an edge leads on from a sure one.
  double weak_evidence = 8;
  // Standard errors that the points by an edge lie inside its corner from which it is rounded, and
  // counts less: only where it leads on from a sure one.
  double blunt = 1.5;
  // Least cosine of an edge and the line along which its sides meet.
  double aligned = 0.85;
  // Faces that meet flatter than this are not looked at; the iso-surface rounds sharp edges.
  double least_fold = 0.985;  // cos 10 degrees
};
RILIEVO_SETTINGS ClassifyEdgesSettings kClassifyEdges;

struct FeaturePlanesSettings {
  static constexpr int most_points = 128;  // gathered around a face: the size of its arrays
};
RILIEVO_SETTINGS FeaturePlanesSettings kFeaturePlanes;

struct SharpEdgesSettings {
  // From half the angle of a sharp edge on one may lead on from it.
  double leads_on = 0.5;  // of kCommon.sharp_angle
  // The edges beside a sharp one that are not sharp bend at most so much of what it does ...
  double beside = 1.0 / 3;
  // ... for this share of the length of all.
  double clean_share = 0.9;
  // A triangle of less height, in spacings, has no plane of its own.
  double thin = 0.01;
  // A line that turns further than this has a corner; looked at over half a spacing.
  double corner = 50 * std::numbers::pi / 180, turn_spacings = 0.5;
  // Lines with a free end are longer, in spacings.
  double shortest_loose_run = 6;
  int most_steps = 32;  // from edge to edge, of those that stand for each other
};
RILIEVO_SETTINGS SharpEdgesSettings kSharpEdges;

struct TagCreasesSettings {
  // Least mean log_likelihood_ratio of the edges of a run.
  double run_evidence = 24;
  // Pull of a vertex to its place, beside one for each plane through it.
  double stay = 0.003;
  // A vertex comes no farther from the points.
  double reach_spacings = 1.5;
};
RILIEVO_SETTINGS TagCreasesSettings kTagCreases;

}  // namespace rilievo
