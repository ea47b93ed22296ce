// How much surface each height stands for, and what an error of each coefficient costs.
#pragma once

#include <cstdint>
#include <vector>

#include "core/codec/height_lifting.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Area of the surface around each vertex of level `max_level`: a third of its faces, each control
// face split evenly among its descendants, but at least a quarter of the mean. Vertices with an
// entry in `filled` have none: their heights are nobody's measurement. Scaled to a sum of 1 (all
// zero when all are filled).
std::vector<double> HeightWeights(const ControlMesh& mesh, const LoopRefinement& refinement,
                                  int max_level, const std::vector<uint8_t>& filled);

// Of the coefficient of each vertex, at the level that first holds it: the squared error, summed
// with these weights over the finest level, that an error of 1 makes. The level's mean comes from
// the synthesis of random signs (Hutchinson's estimate of a trace, which is exact in the mean
// for basis functions of any shape); within a level it follows the weight of the surface around.
struct CoefficientGains {
  std::vector<double> of_vertex;
  std::vector<double>
      of_level;  // the level's mean for a surface of even weight, times its vertices
};
CoefficientGains GainsOf(const HeightLifting& lifting, const LoopRefinement& refinement,
                         const std::vector<double>& weights);

}  // namespace rilievo
