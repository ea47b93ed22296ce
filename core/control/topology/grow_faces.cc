#include "core/control/topology/grow_faces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/base/status_macros.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/topology/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"
#include "core/geometry/vertex_ring.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// New edges are halved above this many times the length wanted: halves are nearer to it.
constexpr double kLongEdge = std::numbers::sqrt2;

void AppendFaces(const std::vector<std::array<int, 3>>& triangles, ControlMesh* mesh) {
  const Eigen::Index before = mesh->faces.cols();
  mesh->faces.conservativeResize(3, before + static_cast<Eigen::Index>(triangles.size()));
  for (size_t i = 0; i < triangles.size(); ++i) {
    mesh->faces.col(before + static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::Vector3i>(triangles[i].data());
  }
}

// Halves edges of no face before `first_new` that are longer than `longest`, the longest first
// and each face once; false when there is none.
absl::StatusOr<bool> HalveLongEdges(Eigen::Index first_new, double longest, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  std::vector<std::pair<double, int>> edges;  // negative length first, so that they sort well
  for (int e = 0; e < topology.edge_count(); ++e) {
    const auto faces = topology.edge_faces.col(e);  // -1: none
    if (std::any_of(faces.begin(), faces.end(), [&](int f) { return f >= 0 && f < first_new; })) {
      continue;
    }
    const double length = (mesh->vertices.col(topology.edge_vertices(0, e)) -
                           mesh->vertices.col(topology.edge_vertices(1, e)))
                              .norm();
    if (length > longest) edges.emplace_back(-length, e);
  }
  if (edges.empty()) return false;
  std::sort(edges.begin(), edges.end());
  std::vector<uint8_t> is_cut(static_cast<size_t>(mesh->faces.cols()), 0);
  std::vector<std::array<int, 3>> halves;
  std::vector<Vector3d> middles;
  for (const auto& [length, edge] : edges) {
    const auto faces = topology.edge_faces.col(edge);
    const auto was_cut = [&](int f) { return f >= 0 && is_cut[f] != 0; };
    if (was_cut(faces[0]) || was_cut(faces[1])) continue;
    const auto middle = static_cast<int>(mesh->vertices.cols()) + static_cast<int>(middles.size());
    middles.push_back((mesh->vertices.col(topology.edge_vertices(0, edge)) +
                       mesh->vertices.col(topology.edge_vertices(1, edge))) /
                      2);
    for (const int face : faces) {
      if (face < 0) continue;
      is_cut[face] = 1;
      const int corner = CornerOfEdge(topology, face, edge), next = kNextCorner[corner];
      halves.push_back({middle, mesh->faces(next, face), mesh->faces(kNextCorner[next], face)});
      mesh->faces(next, face) = middle;
    }
  }
  const Eigen::Index before = mesh->vertices.cols();
  mesh->vertices.conservativeResize(3, before + static_cast<Eigen::Index>(middles.size()));
  for (size_t i = 0; i < middles.size(); ++i) {
    mesh->vertices.col(before + static_cast<Eigen::Index>(i)) = middles[i];
  }
  AppendFaces(halves, mesh);
  return true;
}

// Brings vertices from `first_new` on amid their neighbours, of a border amid those along it, in
// turn.
absl::Status EvenOut(int first_new, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  const VertexRings rings = BuildVertexRings(topology);
  for (int round = 0; round < kGrowFaces.even_rounds; ++round) {
    for (int v = first_new; v < topology.vertex_count; ++v) {
      const std::span<const int> ring = RingOf(rings, v);
      if (topology.boundary_vertex[v] != 0) {
        mesh->vertices.col(v) =
            (mesh->vertices.col(ring.front()) + mesh->vertices.col(ring.back())) / 2;
        continue;
      }
      Vector3d sum = Vector3d::Zero();
      for (const int other : ring) sum += mesh->vertices.col(other);
      mesh->vertices.col(v) = sum / static_cast<double>(ring.size());
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> GrowFaces(ControlMesh mesh, int kept_vertices, const GrownFaces& grown,
                                      const RunContext& context) {
  if (grown.triangles.empty()) return mesh;
  const Eigen::Index face_count = mesh.faces.cols();
  std::vector<Crease> creases = mesh.creases;  // rims are among them until all is done
  double rims = 0, area = 0;
  for (const auto& [a, b] : grown.rims) {
    mesh.creases.push_back({a, b});
    rims += (mesh.vertices.col(b) - mesh.vertices.col(a)).norm();
  }
  for (const auto& corners : grown.triangles) {
    area += FaceCross(mesh.vertices, Eigen::Vector3i::Map(corners.data()), 0).norm() / 2;
  }
  AppendFaces(grown.triangles, &mesh);
  SortTags(&mesh.creases, &mesh.corners);
  // Equilateral faces of that area come to the share of faces.
  const double most_faces = kGrowFaces.share_of_faces * static_cast<double>(face_count);
  const double wanted = std::max(rims / static_cast<double>(grown.rims.size()),
                                 std::sqrt(4 / std::numbers::sqrt3 * area / most_faces));
  // Beside a rim edge that is much longer than the others there is always one more to halve.
  const auto enough = mesh.faces.cols() + static_cast<Eigen::Index>(2 * most_faces);
  bool halved = true;
  for (int round = 0; halved && round < kGrowFaces.most_halvings && mesh.faces.cols() < enough;
       ++round) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(halved, HalveLongEdges(face_count, kLongEdge * wanted, &mesh));
    ImproveValence(&mesh);
  }
  for (int round = 0; round < kGrowFaces.fill_shape_rounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(EvenOut(kept_vertices, &mesh));
    ImproveValence(&mesh);
  }
  mesh.creases = std::move(creases);
  return mesh;
}

}  // namespace rilievo
