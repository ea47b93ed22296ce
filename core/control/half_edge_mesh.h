// Half-edges in flat arrays, for edge collapses at several hundred thousand a second.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// An orientable 2-manifold triangle mesh under edge collapse. Half-edge h = 3 * face + corner runs
// from its corner to the next one. Collapses leave dead faces, edges and vertices behind; ids stay.
// A collapse, and the question whether it can be, writes only at the edge's two ends, at their
// neighbours and in the faces around the ends; it reads the faces around those neighbours too. So
// threads may work side by side where no face has an end of the one and a neighbour of the other.
class HalfEdgeMesh {
 public:
  // INVALID_ARGUMENT with the first fault unless `faces` (indices below `vertex_count`) is an
  // orientable 2-manifold with or without boundary. Vertices without a face are allowed.
  static absl::StatusOr<HalfEdgeMesh> Build(const Eigen::Matrix3Xi& faces, int vertex_count);

  static int Next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int Previous(int h) { return h % 3 == 0 ? h + 2 : h - 1; }

  int From(int h) const { return from_[h]; }
  int To(int h) const { return from_[Next(h)]; }
  int Twin(int h) const { return twin_[h]; }  // -1 on the boundary
  int Edge(int h) const { return edge_[h]; }

  int face_slots() const { return static_cast<int>(from_.size() / 3); }
  int edge_slots() const { return static_cast<int>(edge_half_.size()); }
  int vertex_slots() const { return static_cast<int>(outgoing_.size()); }
  bool FaceAlive(int face) const { return from_[3 * face] >= 0; }
  // A living half-edge of the edge, -1 when the edge is dead.
  int HalfOfEdge(int edge) const { return edge_half_[edge]; }
  // -1 for a dead or unused vertex. At a boundary vertex, the half-edge that runs along the
  // boundary.
  int Outgoing(int vertex) const { return outgoing_[vertex]; }
  int Valence(int vertex) const { return valence_[vertex]; }
  bool OnBoundary(int vertex) const {
    return outgoing_[vertex] >= 0 && twin_[outgoing_[vertex]] < 0;
  }

  // Calls visit(h) for each half-edge that leaves `vertex`, counter-clockwise.
  template <typename Visit>
  void ForEachOutgoing(int vertex, Visit visit) const {
    const int start = outgoing_[vertex];
    int h = start;
    do {
      visit(h);
      h = twin_[Previous(h)];
    } while (h >= 0 && h != start);
  }

  // Calls visit(neighbor, edge) for each neighbour, counter-clockwise.
  template <typename Visit>
  void ForEachNeighbor(int vertex, Visit visit) const {
    const int start = outgoing_[vertex];
    int h = start;
    for (;;) {
      visit(To(h), edge_[h]);
      const int incoming = Previous(h);
      h = twin_[incoming];
      if (h == start) return;
      if (h < 0) {
        visit(from_[incoming], edge_[incoming]);
        return;
      }
    }
  }

  // True when collapsing the edge of h changes neither the topology nor the boundary loops (link
  // condition) and takes an edge from no vertex of `least_valence` (boundary: one less). [3, inf).
  bool CanCollapse(int h, int least_valence);

  // Merges To(h) into From(h). Requires CanCollapse(h).
  void Collapse(int h);

 private:
  absl::Status Link(const Eigen::Matrix3Xi& faces, int vertex_count);
  absl::Status CheckFans() const;
  void NumberEdges();
  void RemoveFace(int h);

  std::vector<int> from_;       // per half-edge, -1 in dead faces
  std::vector<int> twin_;       // per half-edge
  std::vector<int> edge_;       // per half-edge
  std::vector<int> edge_half_;  // per edge
  std::vector<int> outgoing_;   // per vertex
  std::vector<int> valence_;    // per vertex
  std::vector<uint8_t> mark_;   // per vertex, 0 but within CanCollapse
};

}  // namespace rilievo
