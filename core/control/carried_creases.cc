#include "core/control/carried_creases.h"

#include <algorithm>

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kLeastTurnCosine = 0.5;  // cos 60 degrees

}  // namespace

CarriedCreases::CarriedCreases(const HalfEdgeMesh& mesh, const ControlMesh& tagged)
    : freedom_(static_cast<size_t>(mesh.vertex_slots()), Freedom::kAnywhere),
      sharpness_(static_cast<size_t>(mesh.edge_slots()), 0) {
  std::vector<int> sharp_edges(freedom_.size(), 0);
  for (const Crease& crease : tagged.creases) {
    mesh.ForEachNeighbor(crease.a, [&](int neighbor, int edge) {
      if (neighbor == crease.b) sharpness_[edge] = crease.sharpness;
    });
    ++sharp_edges[crease.a], ++sharp_edges[crease.b];
  }
  for (int v = 0; v < mesh.vertex_slots(); ++v) {
    if (sharp_edges[v] == 0) continue;
    const bool runs_on = sharp_edges[v] == 2 && !mesh.OnBoundary(v);
    freedom_[v] = runs_on ? Freedom::kAlongCrease : Freedom::kHeld;
  }
  for (const int corner : tagged.corners) freedom_[corner] = Freedom::kHeldCorner;
}

bool CarriedCreases::Allow(const HalfEdgeMesh& mesh, int h) const {
  const Freedom a = freedom_[mesh.From(h)], b = freedom_[mesh.To(h)];
  if (a == Freedom::kAnywhere || b == Freedom::kAnywhere) return true;
  if (!IsSharp(mesh.Edge(h)) || std::min(a, b) != Freedom::kAlongCrease) return false;
  for (const int side : {h, mesh.Twin(h)}) {
    if (side < 0) continue;
    const bool both = IsSharp(mesh.Edge(HalfEdgeMesh::Next(side))) &&
                      IsSharp(mesh.Edge(HalfEdgeMesh::Previous(side)));
    if (both) return false;
  }
  return true;
}

std::pair<int, int> CarriedCreases::Next(const HalfEdgeMesh& mesh, int vertex, int edge) const {
  std::pair<int, int> next(-1, -1);
  if (freedom_[vertex] != Freedom::kAlongCrease) return next;
  mesh.ForEachNeighbor(vertex, [&](int neighbor, int around) {
    if (around != edge && IsSharp(around)) next = {around, neighbor};
  });
  return next;
}

bool CarriedCreases::KeepTurns(const HalfEdgeMesh& mesh, const std::vector<Vector3d>& positions,
                               int h, const Vector3d& position) const {
  const int edge = mesh.Edge(h);
  if (!IsSharp(edge)) return true;
  const auto turns = [](const Vector3d& from, const Vector3d& at, const Vector3d& to) {
    return (at - from).normalized().dot((to - at).normalized()) < kLeastTurnCosine;
  };
  const auto before = Next(mesh, mesh.From(h), edge), after = Next(mesh, mesh.To(h), edge);
  const bool runs_on = before.second >= 0 && after.second >= 0;
  if (runs_on && turns(positions[before.second], position, positions[after.second])) return false;
  for (const auto& [through, v] : {before, after}) {
    if (v < 0) continue;
    const int beyond = Next(mesh, v, through).second;
    if (beyond >= 0 && turns(position, positions[v], positions[beyond])) return false;
  }
  return true;
}

// Of the two edges at the apex of each face that goes, which become one, either id may live on.
void CarriedCreases::Merge(const HalfEdgeMesh& mesh, int h) {
  const int a = mesh.From(h), b = mesh.To(h);
  freedom_[a] = std::max(freedom_[a], freedom_[b]);
  for (const int side : {h, mesh.Twin(h)}) {
    if (side < 0) continue;
    float& next = sharpness_[mesh.Edge(HalfEdgeMesh::Next(side))];
    float& previous = sharpness_[mesh.Edge(HalfEdgeMesh::Previous(side))];
    next = previous = std::max(next, previous);
  }
}

void CarriedCreases::Tag(const HalfEdgeMesh& mesh, const std::vector<int>& renumbered,
                         ControlMesh* result) const {
  for (int edge = 0; edge < mesh.edge_slots(); ++edge) {
    const int h = mesh.HalfOfEdge(edge);
    if (h < 0 || !IsSharp(edge)) continue;
    const auto [a, b] = std::minmax(renumbered[mesh.From(h)], renumbered[mesh.To(h)]);
    result->creases.push_back({a, b, sharpness_[edge]});
  }
  std::sort(result->creases.begin(), result->creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  for (int v = 0; v < mesh.vertex_slots(); ++v) {
    if (renumbered[v] < 0 || freedom_[v] != Freedom::kHeldCorner) continue;
    result->corners.push_back(renumbered[v]);
  }
}

}  // namespace rilievo
