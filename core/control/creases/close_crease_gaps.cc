#include "core/control/creases/close_crease_gaps.h"

#include <Eigen/Core>
#include <algorithm>

#include "core/base/ablation.h"
#include "core/control/creases/classify_edges.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kLongestGap = 3;             // edges
constexpr double kLeastTurnCosine = 0.5;   // cos 60 degrees
constexpr double kMostFoldCosine = 0.766;  // cos 40 degrees

// The edges that a bridge may take, and the way over them.
class Bridges {
 public:
  Bridges(const ControlMesh& mesh, const MeshTopology& topology, std::vector<uint8_t>* tags)
      : mesh_(mesh),
        topology_(topology),
        tags_(*tags),
        sharp_(static_cast<size_t>(topology.vertex_count), 0),
        edges_(static_cast<size_t>(topology.vertex_count)) {
    for (int e = 0; e < topology.edge_count(); ++e) {
      const bool tagged = tags_[e] != 0;
      if (!tagged && !Folds(e)) continue;
      for (int k = 0; k < 2; ++k) {
        const int v = topology.edge_vertices(k, e);
        sharp_[v] += tagged;
        edges_[v].push_back(e);
      }
    }
  }

  void Build() {
    for (int v = 0; v < topology_.vertex_count; ++v) {
      if (sharp_[v] != 1 || topology_.boundary_vertex[v]) continue;
      for (const int e : edges_[v]) {
        if (!tags_[e]) continue;
        Extend(v, e);
        break;
      }
    }
  }

 private:
  bool Folds(int edge) const {
    const int f = topology_.edge_faces(0, edge), g = topology_.edge_faces(1, edge);
    if (g < 0) return false;
    const Vector3d left = FaceCross(mesh_, f), right = FaceCross(mesh_, g);
    return left.dot(right) < kMostFoldCosine * left.norm() * right.norm();
  }

  // Whether the other two edges of a face beside it are tagged.
  bool ClosesFace(int edge) const {
    for (int k = 0; k < 2; ++k) {
      const int face = topology_.edge_faces(k, edge);
      if (face < 0) continue;
      int tagged = 0;
      for (int i = 0; i < 3; ++i) tagged += tags_[topology_.face_edges(i, face)] != 0;
      if (tagged == 2) return true;
    }
    return false;
  }

  int OtherEnd(int edge, int v) const {
    const auto ends = topology_.edge_vertices.col(edge);
    return ends[0] == v ? ends[1] : ends[0];
  }

  Vector3d Way(int edge, int from) const {
    return (mesh_.vertices.col(OtherEnd(edge, from)) - mesh_.vertices.col(from)).normalized();
  }

  // The straightest way on from the free end `v` of the crease that ends with `last`.
  void Extend(int v, int last) {
    std::vector<int> way, best;
    double straightest = -1;
    Search(v, -Way(last, v), 1, &way, &straightest, &best);
    for (const int e : best) {
      tags_[e] = 1;
      for (int k = 0; k < 2; ++k) ++sharp_[topology_.edge_vertices(k, e)];
    }
  }

  // `worst`: the least cosine of a turn so far.
  void Search(int v, const Vector3d& direction, double worst, std::vector<int>* way,
              double* straightest, std::vector<int>* best) const {
    for (const int e : edges_[v]) {
      if (tags_[e] || ClosesFace(e)) continue;
      const Vector3d on = Way(e, v);
      double least = std::min(worst, direction.dot(on));
      if (least < kLeastTurnCosine) continue;
      const int next = OtherEnd(e, v);
      if (sharp_[next] == 1) least = std::min(least, Arrival(next, on));
      way->push_back(e);
      if (sharp_[next] > 0) {
        const bool better = best->empty() || way->size() < best->size() ||
                            (way->size() == best->size() && least > *straightest);
        if (least >= kLeastTurnCosine && better) {
          *straightest = least;
          *best = *way;
        }
      } else if (way->size() < kLongestGap) {
        Search(next, on, least, way, straightest, best);
      }
      way->pop_back();
    }
  }

  // The cosine of the turn into the crease that ends freely in `v`.
  double Arrival(int v, const Vector3d& direction) const {
    for (const int e : edges_[v]) {
      if (tags_[e]) return direction.dot(Way(e, v));
    }
    return -1;
  }

  const ControlMesh& mesh_;
  const MeshTopology& topology_;
  std::vector<uint8_t>& tags_;
  std::vector<int> sharp_;               // how many tagged edges a vertex has
  std::vector<std::vector<int>> edges_;  // of each vertex: the tagged ones and those that fold
};

}  // namespace

void CloseCreaseGaps(const ControlMesh& mesh, const MeshTopology& topology,
                     std::vector<uint8_t>* tags) {
  if (IsLeftOut(Mechanism::kCreaseGaps)) return;
  Bridges(mesh, topology, tags).Build();
}

}  // namespace rilievo
