#include "core/control/simplify/relax_mesh.h"

#include <Eigen/Geometry>
#include <vector>

#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/crease_constraints.h"
#include "core/control/simplify/half_edge_mesh.h"
#include "core/control/simplify/quadric.h"
#include "core/control/simplify/settings.h"
#include "core/control/simplify/simplify_mesh.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

Vector3d Cross(const ControlMesh& mesh, int a, int b, int c) {
  const Vector3d origin = mesh.vertices.col(a);
  return (mesh.vertices.col(b) - origin).cross(mesh.vertices.col(c) - origin);
}

// What holds a vertex: the planes it was on, and how much area they stand for.
struct Hold {
  Quadric planes;
  double area = 0;
};

Hold HoldOf(const ControlMesh& mesh, const HalfEdgeMesh& half_edges, int v) {
  const Vector3d position = mesh.vertices.col(v);
  Hold hold;
  half_edges.ForEachOutgoing(v, [&](int h) {
    const int to = half_edges.To(h);
    const int apex = half_edges.From(HalfEdgeMesh::Previous(h));
    const Vector3d cross = Cross(mesh, v, to, apex);
    const double length = cross.norm();
    if (!(length > 0)) return;
    hold.planes.AddPlane(cross / length, position, length / 2);
    hold.area += length / 2;
    for (const int side : {h, HalfEdgeMesh::Previous(h)}) {
      if (half_edges.Twin(side) >= 0) continue;
      const Vector3d along = mesh.vertices.col(side == h ? to : apex) - position;
      const Vector3d wall = along.cross(cross);
      if (wall.squaredNorm() > 0) {
        hold.planes.AddPlane(wall.normalized(), position, length / 2);
      }
    }
  });
  return hold;
}

// Where vertex v should go.
Vector3d RelaxedPosition(const ControlMesh& mesh, const HalfEdgeMesh& half_edges,
                         const CreaseConstraints& creases, const Hold& hold, int v) {
  const Vector3d position = mesh.vertices.col(v);
  const bool boundary = half_edges.OnBoundary(v);
  const bool on_crease = creases.ConstraintOf(v) == VertexConstraint::kAlongCrease;
  Vector3d mean = Vector3d::Zero();
  int count = 0;
  half_edges.ForEachNeighbor(v, [&](int neighbor, int edge) {
    if (boundary && half_edges.Twin(half_edges.HalfOfEdge(edge)) >= 0) return;
    if (on_crease && !creases.IsSharp(edge)) return;
    mean += mesh.vertices.col(neighbor);
    ++count;
  });
  if (count == 0 || !(hold.area > 0)) return position;
  Quadric quadric = hold.planes;
  quadric.AddPoint(mean / count, kRelaxMesh.pull * hold.area);
  return quadric.Minimum(position);
}

}  // namespace

void RelaxTangentially(ControlMesh* mesh, int rounds) {
  RunContext alone;
  alone.threads = 1;
  const auto half_edges =
      HalfEdgeMesh::Build(mesh->faces, static_cast<int>(mesh->vertices.cols()), alone);
  if (!half_edges.ok()) return;
  const CreaseConstraints creases(*half_edges, *mesh);
  const auto moves = [&](int v) {
    return half_edges->Outgoing(v) >= 0 && creases.ConstraintOf(v) < VertexConstraint::kHeld;
  };
  std::vector<Hold> holds(static_cast<size_t>(half_edges->vertex_slots()));
  for (int v = 0; v < half_edges->vertex_slots(); ++v) {
    if (moves(v)) holds[v] = HoldOf(*mesh, *half_edges, v);
  }
  for (int round = 0; round < rounds; ++round) {
    // In place, vertex after vertex: each move is checked against the faces as they are.
    for (int v = 0; v < half_edges->vertex_slots(); ++v) {
      if (!moves(v)) continue;
      const Vector3d moved = RelaxedPosition(*mesh, *half_edges, creases, holds[v], v);
      if (moved.allFinite() && KeepsFacesUpright(mesh->vertices, *half_edges, v, moved)) {
        mesh->vertices.col(v) = moved;
      }
    }
  }
}

void ImproveShape(ControlMesh* mesh) {
  for (int round = 0; round < kRelaxMesh.shape_rounds; ++round) {
    ImproveValence(mesh);
    RelaxTangentially(mesh, kRelaxMesh.relax_rounds);
  }
}

}  // namespace rilievo
