#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/settings.h"
#include "core/control/simplify/simplify_mesh.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

struct FlipTraits : public OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::None);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  EdgeAttributes(OpenMesh::Attributes::None);
  FaceAttributes(OpenMesh::Attributes::None);
};
using FlipMesh = OpenMesh::TriMesh_ArrayKernelT<FlipTraits>;

FlipMesh Build(const ControlMesh& mesh) {
  FlipMesh flip_mesh;
  const auto vertices = static_cast<size_t>(mesh.vertices.cols());
  const auto faces = static_cast<size_t>(mesh.faces.cols());
  flip_mesh.reserve(vertices, 3 * faces, faces);
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    flip_mesh.add_vertex({mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v)});
  }
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    flip_mesh.add_face(FlipMesh::VertexHandle(mesh.faces(0, f)),
                       FlipMesh::VertexHandle(mesh.faces(1, f)),
                       FlipMesh::VertexHandle(mesh.faces(2, f)));
  }
  return flip_mesh;
}

// One side of a flip: a triangle's direction and shape.
struct Facet {
  Vector3d normal;
  double roundness;  // 1 equilateral, 0 degenerate
};

Facet FacetOf(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d cross = (b - a).cross(c - a);
  const double length = cross.norm();
  if (!(length > 0)) return {Vector3d::Zero(), 0};
  return {cross / length, Roundness(a, b, c, cross)};
}

// The two triangles at an edge: ends p, q and the vertices r, s opposite it (p, q, r and q, p, s).
class Flip {
 public:
  Flip(const FlipMesh& mesh, FlipMesh::EdgeHandle edge) : mesh_(mesh) {
    const auto half = mesh.halfedge_handle(edge, 0);
    const auto opposite = mesh.halfedge_handle(edge, 1);
    p_ = mesh.from_vertex_handle(half);
    q_ = mesh.to_vertex_handle(half);
    r_ = mesh.opposite_vh(half);
    s_ = mesh.opposite_vh(opposite);
  }

  // Change of the sum of squared distances of the four valences from the ideal.
  int ValenceChange(const std::vector<int>& valence) const {
    const auto change = [&](FlipMesh::VertexHandle v, int step) {
      const int off = valence[v.idx()] - (mesh_.is_boundary(v) ? 4 : 6);
      return (off + step) * (off + step) - off * off;
    };
    return change(p_, -1) + change(q_, -1) + change(r_, 1) + change(s_, 1);
  }

  bool KeepsValence(const std::vector<int>& valence) const {
    return valence[p_.idx()] > (mesh_.is_boundary(p_) ? 3 : 4) &&
           valence[q_.idx()] > (mesh_.is_boundary(q_) ? 3 : 4);
  }

  // `required`: factor on the roundness of the worse face.
  bool KeepsShape(double least_cosine, double floor, double required) const {
    const Vector3d p = At(p_), q = At(q_), r = At(r_), s = At(s_);
    const Facet before[2] = {FacetOf(p, q, r), FacetOf(q, p, s)};
    const Facet after[2] = {FacetOf(p, s, r), FacetOf(q, r, s)};
    if (before[0].normal.dot(before[1].normal) < least_cosine) return false;
    const Vector3d normal = (before[0].normal + before[1].normal).normalized();
    for (const Facet& facet : after) {
      if (facet.normal.dot(normal) < least_cosine) return false;
    }
    const double was = std::min(before[0].roundness, before[1].roundness);
    const double is = std::min(after[0].roundness, after[1].roundness);
    return is > 0 && is >= std::min(floor, required * was);  // no flip to and fro of flat faces
  }

  // `creases`: ascending.
  bool IsOneOf(const std::vector<Crease>& creases) const {
    const std::pair<int, int> ends = std::minmax({p_.idx(), q_.idx()});
    const auto at = std::lower_bound(creases.begin(), creases.end(), ends,
                                     [](const Crease& crease, const auto& pair) {
                                       return std::pair(crease.a, crease.b) < pair;
                                     });
    return at != creases.end() && at->a == ends.first && at->b == ends.second;
  }

  void Count(std::vector<int>* valence) const {
    --(*valence)[p_.idx()];
    --(*valence)[q_.idx()];
    ++(*valence)[r_.idx()];
    ++(*valence)[s_.idx()];
  }

 private:
  Vector3d At(FlipMesh::VertexHandle v) const {
    const auto& point = mesh_.point(v);
    return {point[0], point[1], point[2]};
  }

  const FlipMesh& mesh_;
  FlipMesh::VertexHandle p_, q_, r_, s_;
};

// Each flip lowers the valences' error, or keeps it and rounds the worse face: this ends.
bool FlipOnce(const std::vector<Crease>& creases, FlipMesh* mesh, std::vector<int>* valence,
              double least_cosine) {
  bool flipped = false;
  for (const auto edge : mesh->edges()) {
    if (!mesh->is_flip_ok(edge)) continue;
    const Flip flip(*mesh, edge);
    if (flip.IsOneOf(creases)) continue;
    const int change = flip.ValenceChange(*valence);
    if (change > 0 || !flip.KeepsValence(*valence)) continue;
    const bool shape = change < 0
                           ? flip.KeepsShape(least_cosine, kImproveValence.min_roundness, 1.0)
                           : flip.KeepsShape(least_cosine, 2.0, kImproveValence.rounder);
    if (!shape) continue;
    flip.Count(valence);
    mesh->flip(edge);
    flipped = true;
  }
  return flipped;
}

}  // namespace

void ImproveValence(ControlMesh* mesh, double max_dihedral_degrees) {
  FlipMesh flip_mesh = Build(*mesh);
  if (static_cast<int>(flip_mesh.n_faces()) != mesh->faces.cols()) return;
  std::vector<int> valence(flip_mesh.n_vertices());
  for (const auto vertex : flip_mesh.vertices()) {
    valence[vertex.idx()] = static_cast<int>(flip_mesh.valence(vertex));
  }
  const double least_cosine = std::cos(max_dihedral_degrees * std::numbers::pi / 180);
  while (FlipOnce(mesh->creases, &flip_mesh, &valence, least_cosine)) continue;
  for (const auto face : flip_mesh.faces()) {
    int corner = 0;
    for (const auto vertex : face.vertices()) {
      mesh->faces(corner++, face.idx()) = vertex.idx();
    }
  }
}

}  // namespace rilievo
