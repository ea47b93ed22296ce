// How the polygons of a mesh hang together.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/polygon_mesh.h"

namespace rilievo {

// Half-edge h runs from corner h of the mesh to the next corner of the same face. All by half-edge
// where nothing else is said.
struct PolygonTopology {
  std::vector<int> next, previous;
  std::vector<int> face;
  std::vector<int> twin;             // the half-edge across, or -1 on the border
  std::vector<int> edge;             // numbered in the order in which half-edges first meet them
  std::vector<int> edge_half_edges;  // by edge: the half-edge that met it first
  std::vector<int> outgoing;         // by vertex: a half-edge from it, on the border that along it

  int edge_count() const { return static_cast<int>(edge_half_edges.size()); }
  bool OnBorder(int vertex) const { return At(twin, At(outgoing, vertex)) < 0; }
  // The half-edges that leave a vertex, counter-clockwise.
  std::vector<int> Ring(int vertex) const {
    std::vector<int> ring;
    for (int h = At(outgoing, vertex); h >= 0 && (ring.empty() || h != ring[0]);
         h = At(twin, At(previous, h))) {
      ring.push_back(h);
    }
    return ring;
  }
  static int At(const std::vector<int>& table, int i) { return table[static_cast<size_t>(i)]; }
};

// INVALID_ARGUMENT that names the first offending face, edge or vertex, counted from 0, unless the
// faces are an orientable 2-manifold with or without border: at least one face, three corners or
// more in each, all different and within range, an edge at most once in each direction, one fan of
// faces at each vertex, no vertex without a face.
absl::StatusOr<PolygonTopology> BuildPolygonTopology(const PolygonMesh& mesh);

}  // namespace rilievo
