// Half-edges in flat arrays, for edge collapses at several hundred thousand a second.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

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
  // CANCELLED when stopped.
  static absl::StatusOr<HalfEdgeMesh> Build(const Eigen::Matrix3Xi& faces, int vertex_count,
                                            const RunContext& context);

  static int Next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int Previous(int h) { return h % 3 == 0 ? h + 2 : h - 1; }

  int From(int h) const { return half_[h].from; }
  int To(int h) const { return half_[Next(h)].from; }
  int Twin(int h) const { return half_[h].twin; }  // -1 on the boundary
  int Edge(int h) const { return half_[h].edge; }

  int face_slots() const { return static_cast<int>(half_.size() / 3); }
  int edge_slots() const { return static_cast<int>(edge_half_.size()); }
  int vertex_slots() const { return static_cast<int>(vertex_.size()); }
  bool FaceAlive(int face) const { return half_[3 * face].from >= 0; }
  // A living half-edge of the edge, -1 when the edge is dead.
  int HalfOfEdge(int edge) const { return edge_half_[edge]; }
  // -1 for a dead or unused vertex. At a boundary vertex, the half-edge that runs along the
  // boundary.
  int Outgoing(int vertex) const { return vertex_[vertex].outgoing; }
  int Valence(int vertex) const { return vertex_[vertex].valence; }
  bool OnBoundary(int vertex) const {
    const int outgoing = vertex_[vertex].outgoing;
    return outgoing >= 0 && half_[outgoing].twin < 0;
  }

  // Calls visit(h) for each half-edge that leaves `vertex`, counter-clockwise.
  template <typename Visit>
  void ForEachOutgoing(int vertex, Visit visit) const {
    const int start = vertex_[vertex].outgoing;
    int h = start;
    do {
      visit(h);
      h = half_[Previous(h)].twin;
    } while (h >= 0 && h != start);
  }

  // Calls visit(neighbor, edge) for each neighbour, counter-clockwise.
  template <typename Visit>
  void ForEachNeighbor(int vertex, Visit visit) const {
    const int start = vertex_[vertex].outgoing;
    int h = start;
    for (;;) {
      visit(To(h), half_[h].edge);
      const Half& incoming = half_[Previous(h)];
      h = incoming.twin;
      if (h == start) return;
      if (h < 0) {
        visit(incoming.from, incoming.edge);
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
  absl::Status Link(const Eigen::Matrix3Xi& faces, int vertex_count, const RunContext& context);
  absl::Status CheckFans(const RunContext& context) const;
  void NumberEdges();
  void RemoveFace(int h);

  // Side by side, for collapses hop about the mesh: what they touch of a face or a vertex comes in
  // one cache line.
  struct Half {
    int from;  // -1 in dead faces
    int twin, edge;
  };
  struct Vertex {
    int outgoing = -1;
    int valence = 0;
    int mark = 0;  // 0 but within CanCollapse
  };

  std::vector<Half> half_;
  std::vector<Vertex> vertex_;
  std::vector<int> edge_half_;  // per edge
};

}  // namespace rilievo
