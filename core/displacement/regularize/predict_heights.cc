#include "core/displacement/regularize/predict_heights.h"

#include <cmath>

#include "core/base/ablation.h"

namespace rilievo {

std::optional<float> PredictHeight(const MeshTopology& coarser, int edge,
                                   const HeightSamples& samples) {
  if (IsLeftOut(Mechanism::kPredictHeights)) return std::nullopt;
  float height = 0;
  const auto add = [&](int vertex, float weight) {
    height += weight * samples.height[vertex];
    return samples.measured[vertex] != 0;
  };
  for (int end = 0; end < 2; ++end) {
    if (!add(coarser.edge_vertices(end, edge), 0.5f)) return std::nullopt;
  }
  for (int side = 0; side < 2; ++side) {
    const int face = coarser.edge_faces(side, edge);
    if (face < 0) return std::nullopt;
    int corner = 0;
    while (coarser.face_edges(corner, face) != edge) ++corner;
    if (!add(coarser.faces((corner + 2) % 3, face), 0.125f)) return std::nullopt;
    for (const int wing : {(corner + 1) % 3, (corner + 2) % 3}) {
      const int across = coarser.face_neighbors(wing, face);
      if (across < 0) return std::nullopt;
      int back = 0;
      while (coarser.face_neighbors(back, across) != face) ++back;
      if (!add(coarser.faces((back + 2) % 3, across), -0.0625f)) return std::nullopt;
    }
  }
  return height;
}

std::vector<uint8_t> PredictionFailures(const LoopRefinement& refinement, int level,
                                        float deviations, const HeightSamples& samples) {
  std::vector<uint8_t> rough(refinement.vertex_count(level), level == 0 ? 1 : 0);
  if (level == 0) return rough;
  const MeshTopology& coarser = refinement.levels[level - 1];
  for (int edge = 0; edge < coarser.edge_count(); ++edge) {
    const int vertex = coarser.vertex_count + edge;
    const auto predicted = PredictHeight(coarser, edge, samples);
    if (predicted && samples.measured[vertex] != 0 &&
        std::abs(samples.height[vertex] - *predicted) <= deviations * samples.deviation[vertex]) {
      continue;
    }
    rough[vertex] = 1;
    for (int end = 0; end < 2; ++end) rough[coarser.edge_vertices(end, edge)] = 1;
  }
  return rough;
}

}  // namespace rilievo
