#include "core/control/simplify/crease_constraints.h"

#include <algorithm>

#include "core/control/simplify/settings.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

}  // namespace

CreaseConstraints::CreaseConstraints(const HalfEdgeMesh& mesh, const ControlMesh& tagged)
    : constraint_(static_cast<size_t>(mesh.vertex_slots()), VertexConstraint::kAnywhere),
      sharpness_(static_cast<size_t>(mesh.edge_slots()), 0) {
  for (const Crease& crease : tagged.creases) {
    mesh.ForEachNeighbor(crease.a, [&](int neighbor, int edge) {
      if (neighbor == crease.b) sharpness_[edge] = crease.sharpness;
    });
  }
  for (const Crease& crease : tagged.creases) {
    for (const int v : {crease.a, crease.b}) {
      int sharp = 0;
      bool alike = true;
      mesh.ForEachNeighbor(v, [&](int, int edge) {
        if (!IsSharp(edge)) return;
        ++sharp;
        alike = alike && sharpness_[edge] == crease.sharpness;
      });
      const bool runs_on = sharp == 2 && alike && !mesh.OnBoundary(v);
      constraint_[v] = runs_on ? VertexConstraint::kAlongCrease : VertexConstraint::kHeld;
    }
  }
  for (const int corner : tagged.corners) constraint_[corner] = VertexConstraint::kHeldCorner;
}

bool CreaseConstraints::Allow(const HalfEdgeMesh& mesh, int h) const {
  const int from = mesh.From(h), to = mesh.To(h);
  const VertexConstraint a = constraint_[from], b = constraint_[to];
  if (a == VertexConstraint::kAnywhere || b == VertexConstraint::kAnywhere) {
    // The boundary comes to no crease inside.
    return a == b || !mesh.OnBoundary(a < b ? from : to);
  }
  if (!IsSharp(mesh.Edge(h)) || std::min(a, b) != VertexConstraint::kAlongCrease) return false;
  for (const int side : {h, mesh.Twin(h)}) {
    if (side < 0) continue;
    const bool both = IsSharp(mesh.Edge(HalfEdgeMesh::Next(side))) &&
                      IsSharp(mesh.Edge(HalfEdgeMesh::Previous(side)));
    if (both) return false;
  }
  return true;
}

std::pair<int, int> CreaseConstraints::Next(const HalfEdgeMesh& mesh, int vertex, int edge) const {
  std::pair<int, int> next(-1, -1);
  if (constraint_[vertex] != VertexConstraint::kAlongCrease) return next;
  mesh.ForEachNeighbor(vertex, [&](int neighbor, int around) {
    if (around != edge && IsSharp(around)) next = {around, neighbor};
  });
  return next;
}

bool CreaseConstraints::KeepTurns(const HalfEdgeMesh& mesh, const std::vector<Vector3d>& positions,
                                  int h, const Vector3d& position) const {
  const int edge = mesh.Edge(h), a = mesh.From(h), b = mesh.To(h);
  if (!IsSharp(edge)) return true;
  const auto cosine = [](const Vector3d& from, const Vector3d& at, const Vector3d& to) {
    return (at - from).normalized().dot((to - at).normalized());
  };
  const auto [before, p] = Next(mesh, a, edge);
  const auto [after, q] = Next(mesh, b, edge);
  double sharpest = kCreaseConstraints.least_turn_cosine;  // that is there already
  if (p >= 0) sharpest = std::min(sharpest, cosine(positions[p], positions[a], positions[b]));
  if (q >= 0) sharpest = std::min(sharpest, cosine(positions[a], positions[b], positions[q]));
  if (p >= 0 && q >= 0 && cosine(positions[p], position, positions[q]) < sharpest) return false;
  const auto keeps = [&](int v, int through, const Vector3d& was) {
    const int beyond = v >= 0 ? Next(mesh, v, through).second : -1;
    if (beyond < 0) return true;
    const double least = std::min(kCreaseConstraints.least_turn_cosine,
                                  cosine(was, positions[v], positions[beyond]));
    return cosine(position, positions[v], positions[beyond]) >= least;
  };
  return keeps(p, before, positions[a]) && keeps(q, after, positions[b]);
}

// Of the two edges at the apex of each face that goes, which become one, either id may live on.
void CreaseConstraints::Merge(const HalfEdgeMesh& mesh, int h) {
  const int a = mesh.From(h), b = mesh.To(h);
  constraint_[a] = std::max(constraint_[a], constraint_[b]);
  for (const int side : {h, mesh.Twin(h)}) {
    if (side < 0) continue;
    float& next = sharpness_[mesh.Edge(HalfEdgeMesh::Next(side))];
    float& previous = sharpness_[mesh.Edge(HalfEdgeMesh::Previous(side))];
    next = previous = std::max(next, previous);
  }
}

void CreaseConstraints::Tag(const HalfEdgeMesh& mesh, const std::vector<int>& renumbered,
                            ControlMesh* result) const {
  for (int edge = 0; edge < mesh.edge_slots(); ++edge) {
    const int h = mesh.HalfOfEdge(edge);
    if (h < 0 || !IsSharp(edge)) continue;
    const auto [a, b] = std::minmax(renumbered[mesh.From(h)], renumbered[mesh.To(h)]);
    result->creases.push_back({a, b, sharpness_[edge]});
  }
  for (int v = 0; v < mesh.vertex_slots(); ++v) {
    if (renumbered[v] < 0 || constraint_[v] != VertexConstraint::kHeldCorner) continue;
    result->corners.push_back(renumbered[v]);
  }
  SortTags(&result->creases, &result->corners);
}

}  // namespace rilievo
