// What creases and corners change in a refinement: few vertices and edges of each level.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_masks.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

// One level. All other edges and vertices follow the smooth and boundary rules.
struct SharpLevel {
  std::vector<SharpEdge> edges;  // ascending
  // Vertices that have, or at a coarser level had, a sharp interior edge, and corners; ascending.
  // vertices[i] goes on the next level to the sum of `weights` of `neighbors` (itself included),
  // entries [begin[i], begin[i + 1]).
  std::vector<int> vertices;
  std::vector<int> begin = {0};
  std::vector<int> neighbors;
  std::vector<double> weights;
};

// A control vertex with a sharp interior edge, or a corner.
struct SharpControlVertex {
  int vertex = 0;
  std::vector<int> neighbors;        // counter-clockwise as in VertexRings
  std::vector<uint32_t> half_edges;  // 3 f + k: corner k of face f, between neighbours i and i + 1
  SharpLimitMask limit;              // on `neighbors`
};

struct SharpRefinement {
  std::vector<SharpControlVertex> control;  // ascending
  std::vector<SharpLevel> levels;           // of the levels with faces; none when all is smooth
  bool empty() const { return levels.empty(); }
};

// The rules of `mesh`' creases and corners on all `levels`, the refinement of its faces; empty
// without creases and corners. Errors as BuildCreaseTopology.
absl::StatusOr<SharpRefinement> RefineCreases(const ControlMesh& mesh,
                                              const std::vector<MeshTopology>& levels);

// Whether the vertex on a sharp edge starts with two sharp edges itself; else it starts smooth.
inline bool StartsSharp(const SharpEdge& sharp) { return sharp.sharpness > 1.0f; }

// The limit masks of the vertices on sharp edges, on RingOfEdgeVertex. Keeps the last one.
class SharpEdgeLimits {
 public:
  const SharpLimitMask& Of(const SharpEdge& sharp);

 private:
  float sharpness_ = 0.0f;
  SharpLimitMask limit_;
};

}  // namespace rilievo
