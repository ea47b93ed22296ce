// One step of Loop subdivision for single vertices, shared by positions and stencils.
#pragma once

#include <algorithm>

#include "core/loop/edge_star.h"
#include "core/loop/loop_masks.h"
#include "core/loop/sharp_refinement.h"

namespace rilievo {

// A vertex p and the sum s of its ring (on the boundary: of its two boundary neighbours) go over
// into those of the next level without a look at the ring itself:
//   p' = self p + ring s,    s' = sum_self p + sum_ring s.
// Interior, valence n: every new neighbour is 3/8 p + 3/8 p_i + 1/8 (p_{i-1} + p_{i+1}), so
// s' = 3n/8 p + 5/8 s. Boundary: the new neighbours are midpoints, s' = p + s/2.
struct VertexRule {
  double self, ring, sum_self, sum_ring;
};

inline constexpr VertexRule kBoundaryVertexRule = {3.0 / 4.0, 1.0 / 8.0, 1.0, 1.0 / 2.0};
inline constexpr VertexRule kRegularVertexRule = {5.0 / 8.0, 1.0 / 16.0, 9.0 / 4.0, 5.0 / 8.0};

inline VertexRule RuleOfVertex(const MeshTopology& topology, int vertex) {
  if (topology.boundary_vertex[vertex]) return kBoundaryVertexRule;
  const int valence = topology.valence[vertex];
  if (valence == 6) return kRegularVertexRule;
  const double beta = LoopBeta(valence);
  return {1.0 - valence * beta, beta, 3.0 / 8.0 * valence, 5.0 / 8.0};
}

// The new vertex of an edge. `values`: column = vertex.
template <typename Matrix>
inline auto EdgePoint(const EdgeStar& star, const Matrix& values) ->
    typename Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1> {
  if (star.boundary()) return 0.5 * (values.col(star.from) + values.col(star.to));
  return 0.375 * (values.col(star.from) + values.col(star.to)) +
         0.125 * (values.col(star.opposite_first) + values.col(star.opposite_second));
}

// The new vertex of a sharp edge, with its own weights of the edge's ends and opposite corners.
struct SharpEdgeWeights {
  double end, opposite;
};
inline SharpEdgeWeights WeightsOfSharpEdge(const SharpEdge& sharp) {
  const double crease = std::min(sharp.sharpness, 1.0f);
  return {0.375 + 0.125 * crease, 0.125 * (1.0 - crease)};
}

inline Eigen::Vector3d SharpEdgePoint(const MeshTopology& topology, const SharpEdge& sharp,
                                      const Eigen::Matrix3Xd& values) {
  const EdgeStar star = StarOfEdge(topology, sharp.edge);
  const SharpEdgeWeights weights = WeightsOfSharpEdge(sharp);
  return weights.end * (values.col(star.from) + values.col(star.to)) +
         weights.opposite * (values.col(star.opposite_first) + values.col(star.opposite_second));
}

// Where sharp.vertices[i] goes.
inline Eigen::Vector3d SharpVertexPoint(const SharpLevel& sharp, size_t i,
                                        const Eigen::Matrix3Xd& values) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int n = sharp.begin[i]; n < sharp.begin[i + 1]; ++n) {
    point += sharp.weights[n] * values.col(sharp.neighbors[n]);
  }
  return point;
}

}  // namespace rilievo
