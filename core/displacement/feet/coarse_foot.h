// A foot as coarser levels see it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/displacement/feet/point_feet.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The row of a point for heights of a coarser level that are prolonged to the finest: what a vertex
// on an edge takes part goes half to each end. The corners of a triangle have their parents among
// the three of the triangle it came of, so that three are enough.
class CoarseFoot {
 public:
  // `foot` is found.
  CoarseFoot(const PointFoot& foot, const LoopRefinement& refinement, int level)
      : corner_(foot.corner) {
    std::copy(foot.weight.begin(), foot.weight.end(), weight_.begin());
    for (int l = refinement.max_level() - 1; l >= level; --l) PushTo(refinement.levels[l]);
  }
  // Those that are not needed are -1.
  const std::array<int, 3>& corner() const { return corner_; }
  const std::array<double, 3>& weight() const { return weight_; }
  int NearestCorner() const {
    const auto smaller = [](double a, double b) { return std::abs(a) < std::abs(b); };
    const auto* largest = std::max_element(weight_.begin(), weight_.end(), smaller);
    return corner_[largest - weight_.begin()];
  }

 private:
  void PushTo(const MeshTopology& coarse) {
    const CoarseFoot fine = *this;
    corner_ = {-1, -1, -1};
    weight_ = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      const int v = fine.corner_[k];
      if (v < 0) continue;
      if (v < coarse.vertex_count) {
        Add(v, fine.weight_[k]);
        continue;
      }
      const auto ends = coarse.edge_vertices.col(v - coarse.vertex_count);
      Add(ends[0], 0.5 * fine.weight_[k]);
      Add(ends[1], 0.5 * fine.weight_[k]);
    }
  }
  void Add(int vertex, double weight) {
    for (int k = 0; k < 3; ++k) {
      if (corner_[k] >= 0 && corner_[k] != vertex) continue;
      corner_[k] = vertex;
      weight_[k] += weight;
      return;
    }
  }

  std::array<int, 3> corner_;
  std::array<double, 3> weight_;
};

}  // namespace rilievo
