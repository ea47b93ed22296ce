// How much surface each height stands for, and what an error of each coefficient costs.
#pragma once

#include <cstdint>
#include <vector>

#include "core/codec/heights/height_lifting.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Filled heights within so many rings of told ones, those that are not filled, count with this
// share of their area: points lie beside them. All free, largest errors were 3 % larger in the mean
// of 72 scans and up to twice as large; at their whole area files took up to 10 % more bytes,
// so 7.5 %.
constexpr int kRimRings = 3;
constexpr double kRimShare = 0.25;

// Area of the surface around each vertex of level `max_level`: a third of its faces, each control
// face split evenly among its descendants, but at least a quarter of the mean. `rings`: from the
// nearest told height (RingsIntoHoles); vertices beyond kRimRings have none. Scaled to a sum of 1
// (all zero when there are none but those). `mean`, unless 0: that of the surface which this is a
// part of; the weights are then shares of it instead.
std::vector<double> HeightWeights(const ControlMesh& mesh, const LoopRefinement& refinement,
                                  int max_level, const std::vector<uint8_t>& rings,
                                  double mean = 0);

// The mean area around the vertices of level `max_level`.
double MeanHeightWeight(const ControlMesh& mesh, const MeshTopology& topology, int max_level);

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
// The same with the means of the levels given.
CoefficientGains GainsOf(const std::vector<double>& of_level, const HeightLifting& lifting,
                         const LoopRefinement& refinement, const std::vector<double>& weights);

}  // namespace rilievo
