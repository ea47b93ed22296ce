#include "core/bicubic/patch_domains.h"

#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/quad_topology.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

Vector3d WeightsOfVertex(const MeshTopology& topology, int face, int vertex) {
  Vector3d weights = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) weights[k] = topology.faces(k, face) == vertex ? 1 : 0;
  return weights;
}

// Whether an edge of the control mesh begins at the vertex.
bool Begins(const MeshTopology& topology, int edge, int vertex) {
  return topology.edge_vertices(0, edge) == vertex;
}

PatchDomains DomainsOfTriangles(const MeshTopology& topology) {
  const int first_center = topology.vertex_count + topology.edge_count();
  const Vector3d center = Vector3d::Constant(1.0 / 3.0);
  PatchDomains domains;
  domains.vertex_count = first_center + topology.face_count();
  // The halves of edge e are 2 e and 2 e + 1.
  for (int e = 0; e < topology.edge_count(); ++e) {
    const int face = topology.edge_faces(0, e);
    const Vector3d begin = WeightsOfVertex(topology, face, topology.edge_vertices(0, e)),
                   end = WeightsOfVertex(topology, face, topology.edge_vertices(1, e));
    const Vector3d middle = 0.5 * (begin + end);
    const int vertex = topology.vertex_count + e;
    domains.edges.push_back({topology.edge_vertices(0, e), vertex, face, begin, middle});
    domains.edges.push_back({vertex, topology.edge_vertices(1, e), face, middle, end});
  }
  const int first_spoke = 2 * topology.edge_count();
  for (int f = 0; f < topology.face_count(); ++f) {
    std::array<Vector3d, 3> corners, middles;
    for (int k = 0; k < 3; ++k) corners[k] = Vector3d::Unit(k);
    for (int k = 0; k < 3; ++k) {
      middles[k] = 0.5 * (corners[k] + corners[kNextCorner[k]]);
      domains.edges.push_back({topology.vertex_count + topology.face_edges(k, f), first_center + f,
                               f, middles[k], center});
    }
    for (int k = 0; k < 3; ++k) {
      const int before = kPreviousCorner[k], vertex = topology.faces(k, f);
      const int out = topology.face_edges(k, f), in = topology.face_edges(before, f);
      const bool out_begins = Begins(topology, out, vertex),
                 in_begins = Begins(topology, in, vertex);
      domains.patches.push_back({{2 * out + (out_begins ? 0 : 1), first_spoke + 3 * f + k,
                                  first_spoke + 3 * f + before, 2 * in + (in_begins ? 0 : 1)},
                                 {out_begins, true, false, !in_begins},
                                 {f, f},
                                 {corners[k], middles[k], center},
                                 {corners[k], center, middles[before]}});
    }
  }
  return domains;
}

PatchDomains DomainsOfQuads(const MeshTopology& topology, const QuadLevel& quads) {
  PatchDomains domains;
  domains.vertex_count = topology.vertex_count;
  std::vector<int> number(topology.edge_count(), -1);
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (quads.diagonal[e] != 0) continue;
    number[e] = static_cast<int>(domains.edges.size());
    const int face = topology.edge_faces(0, e), from = topology.edge_vertices(0, e),
              to = topology.edge_vertices(1, e);
    domains.edges.push_back({from, to, face, WeightsOfVertex(topology, face, from),
                             WeightsOfVertex(topology, face, to)});
  }
  for (int f = 0; f < topology.face_count(); ++f) {
    const Quad quad = QuadOfFace(topology, quads, f);
    if (topology.edge_faces(0, quad.diagonal) != f) continue;
    DomainPatch patch;
    patch.faces = {f, topology.edge_faces(1, quad.diagonal)};
    for (size_t i = 0; i < 4; ++i) {
      patch.edges[i] = number[quad.edges[i]];
      patch.forward[i] = Begins(topology, quad.edges[i], quad.vertices[i]);
    }
    for (size_t i = 0; i < 3; ++i) {
      patch.first[i] = WeightsOfVertex(topology, patch.faces[0], quad.vertices[i]);
      patch.second[i] =
          WeightsOfVertex(topology, patch.faces[1], quad.vertices[i == 0 ? 0 : i + 1]);
    }
    domains.patches.push_back(patch);
  }
  return domains;
}

}  // namespace

FacePlace DomainPatch::At(double s, double t) const {
  if (faces[0] == faces[1]) {
    return {faces[0], (1 - s) * (1 - t) * first[0] + s * (1 - t) * first[1] + s * t * first[2] +
                          (1 - s) * t * second[2]};
  }
  if (t <= s) return {faces[0], (1 - s) * first[0] + (s - t) * first[1] + t * first[2]};
  return {faces[1], (1 - t) * second[0] + s * second[1] + (t - s) * second[2]};
}

absl::StatusOr<PatchDomains> DomainsOf(const ControlMesh& mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  if (!mesh.quads()) return DomainsOfTriangles(topology);
  QuadLevel quads;
  RILIEVO_ASSIGN_OR_RETURN(quads.diagonal, FlagsOfDiagonals(mesh, topology));
  return DomainsOfQuads(topology, quads);
}

}  // namespace rilievo
