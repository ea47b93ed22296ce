#include "core/control/quads/quad_control_mesh.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/status_macros.h"
#include "core/control/quads/improve_quads.h"
#include "core/control/quads/pair_triangles.h"
#include "core/control/quads/polygon_set.h"
#include "core/geometry/connected_parts.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

// Each triangle as three quads around its centroid.
ControlMesh SplitEachTriangle(const ControlMesh& mesh, const MeshTopology& topology,
                              const CreaseTopology& creases) {
  const int first_middle = topology.vertex_count;
  const int first_center = first_middle + topology.edge_count();
  ControlMesh made;
  made.vertices.resize(3, first_center + topology.face_count());
  made.vertices.leftCols(first_middle) = mesh.vertices;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const auto ends = topology.edge_vertices.col(e);
    made.vertices.col(first_middle + e) =
        0.5 * (mesh.vertices.col(ends[0]) + mesh.vertices.col(ends[1]));
  }
  made.faces.resize(3, 6 * static_cast<Eigen::Index>(topology.face_count()));
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto corners = topology.faces.col(f), sides = topology.face_edges.col(f);
    const int center = first_center + f;
    made.vertices.col(center) = (mesh.vertices.col(corners[0]) + mesh.vertices.col(corners[1]) +
                                 mesh.vertices.col(corners[2])) /
                                3;
    for (int k = 0; k < 3; ++k) {
      const int after = first_middle + sides[k], before = first_middle + sides[kPreviousCorner[k]];
      made.faces.col(6 * Eigen::Index{f} + 2 * k) << corners[k], after, center;
      made.faces.col(6 * Eigen::Index{f} + 2 * k + 1) << corners[k], center, before;
      made.diagonals.push_back({corners[k], center});
    }
  }
  for (const SharpEdge& sharp : creases.edges) {
    for (int end = 0; end < 2; ++end) {
      made.creases.push_back(
          {topology.edge_vertices(end, sharp.edge), first_middle + sharp.edge, sharp.sharpness});
    }
  }
  made.corners = mesh.corners;
  SortTags(&made.creases, &made.corners);
  std::sort(made.diagonals.begin(), made.diagonals.end());
  return made;
}

// Vertices, faces and tags of each in the order that they have in the whole mesh.
std::vector<ControlMesh> ComponentsOf(const ControlMesh& mesh, const MeshTopology& topology) {
  const std::vector<uint8_t> all(static_cast<size_t>(topology.face_count()), 1);
  int count = 0;
  const std::vector<int> component = ConnectedParts(
      all, [&](int f) { return topology.face_neighbors.col(f); }, &count);
  if (count == 1) return {mesh};
  std::vector<int> of_vertex(topology.vertex_count), number(topology.vertex_count);
  std::vector<int> vertices(count, 0), faces(count, 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    ++faces[component[f]];
    for (const int v : topology.faces.col(f)) of_vertex[v] = component[f];
  }
  for (int v = 0; v < topology.vertex_count; ++v) number[v] = vertices[of_vertex[v]]++;
  std::vector<ControlMesh> components(count);
  for (int c = 0; c < count; ++c) {
    components[c].vertices.resize(3, vertices[c]);
    components[c].faces.resize(3, faces[c]);
    faces[c] = 0;
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    components[of_vertex[v]].vertices.col(number[v]) = mesh.vertices.col(v);
  }
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto corners = topology.faces.col(f);
    components[component[f]].faces.col(faces[component[f]]++) << number[corners[0]],
        number[corners[1]], number[corners[2]];
  }
  for (const Crease& crease : mesh.creases) {
    components[of_vertex[crease.a]].creases.push_back(
        {number[crease.a], number[crease.b], crease.sharpness});
  }
  for (const int corner : mesh.corners) {
    components[of_vertex[corner]].corners.push_back(number[corner]);
  }
  return components;
}

absl::StatusOr<ControlMesh> QuadsOfComponent(const ControlMesh& mesh) {
  PolygonSet polygons(mesh);
  if (PairTriangles(&polygons)) {
    ImproveQuads(&polygons);
    if (std::optional<ControlMesh> made = polygons.ToControlMesh(mesh.corners)) {
      return *std::move(made);
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(mesh, topology));
  return SplitEachTriangle(mesh, topology, creases);
}

// The faces on both sides of each edge, which is written with the lower vertex first.
template <typename Visit>
void ForEachInnerEdge(const ControlMesh& mesh, const Visit& visit) {
  std::map<std::array<int, 2>, int> first;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(mesh.faces(k, f), mesh.faces((k + 1) % 3, f));
      const auto [entry, is_new] = first.try_emplace({a, b}, f);
      if (!is_new) visit(entry->first, entry->second, f);
    }
  }
}

ControlMesh Joined(const std::vector<ControlMesh>& components) {
  Eigen::Index vertices = 0, faces = 0;
  for (const ControlMesh& component : components) {
    vertices += component.vertices.cols();
    faces += component.faces.cols();
  }
  ControlMesh mesh;
  mesh.vertices.resize(3, vertices);
  mesh.faces.resize(3, faces);
  int first = 0;
  Eigen::Index first_face = 0;
  for (const ControlMesh& component : components) {
    mesh.vertices.middleCols(first, component.vertices.cols()) = component.vertices;
    mesh.faces.middleCols(first_face, component.faces.cols()) = component.faces.array() + first;
    for (const Crease& crease : component.creases) {
      mesh.creases.push_back({first + crease.a, first + crease.b, crease.sharpness});
    }
    for (const int corner : component.corners) mesh.corners.push_back(first + corner);
    for (const auto& [a, b] : component.diagonals) mesh.diagonals.push_back({first + a, first + b});
    first += static_cast<int>(component.vertices.cols());
    first_face += component.faces.cols();
  }
  return mesh;
}

}  // namespace

absl::StatusOr<ControlMesh> QuadControlMesh(const ControlMesh& mesh) {
  if (mesh.quads()) return absl::InvalidArgumentError("the control mesh has quads already");
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_RETURN_IF_ERROR(BuildCreaseTopology(mesh, topology).status());
  std::vector<ControlMesh> components = ComponentsOf(mesh, topology);
  for (ControlMesh& component : components) {
    RILIEVO_ASSIGN_OR_RETURN(component, QuadsOfComponent(component));
  }
  return Joined(components);
}

void ShareBetweenHalves(const ControlMesh& quads, std::vector<float>* of_face) {
  ForEachInnerEdge(quads, [&](const std::array<int, 2>& edge, int f, int g) {
    if (!std::ranges::binary_search(quads.diagonals, edge)) return;
    float& a = (*of_face)[static_cast<size_t>(f)];
    float& b = (*of_face)[static_cast<size_t>(g)];
    a = b = (a + b) / 2;
  });
}

}  // namespace rilievo
