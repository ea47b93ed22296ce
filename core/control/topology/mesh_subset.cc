#include "core/control/topology/mesh_subset.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

// Drops unused vertices.
MeshSubset DropUnused(const ControlMesh& mesh) {
  MeshSubset part;
  std::vector<int> renamed(mesh.vertices.cols(), -1);
  part.mesh.faces.resize(3, mesh.faces.cols());
  for (int64_t c = 0; c < mesh.faces.size(); ++c) {
    int& vertex = renamed[mesh.faces.data()[c]];
    if (vertex < 0) {
      vertex = static_cast<int>(part.source_vertex.size());
      part.source_vertex.push_back(mesh.faces.data()[c]);
    }
    part.mesh.faces.data()[c] = vertex;
  }
  part.mesh.vertices = mesh.vertices(Eigen::all, part.source_vertex);
  return part;
}

}  // namespace

MeshSubset SplitFans(const ControlMesh& mesh) {
  // Nearly always there is nothing to split, and that is cheap to see.
  MeshSubset whole = DropUnused(mesh);
  if (BuildMeshTopology(whole.mesh.faces, static_cast<int>(whole.mesh.vertices.cols())).ok()) {
    return whole;
  }
  const int64_t corner_count = 3 * mesh.faces.cols();
  // Corners of one vertex that share an edge belong to one fan.
  std::vector<int> parent(corner_count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int c) {
    while (parent[c] != c) c = parent[c] = parent[parent[c]];
    return c;
  };
  struct HalfEdge {
    int low, high, corner_at_low, corner_at_high;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(corner_count);
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = 3 * f + k, b = 3 * f + (k + 1) % 3;
      const int va = mesh.faces(k, f), vb = mesh.faces((k + 1) % 3, f);
      edges.push_back(va < vb ? HalfEdge{va, vb, a, b} : HalfEdge{vb, va, b, a});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::array{a.low, a.high, a.corner_at_low} < std::array{b.low, b.high, b.corner_at_low};
  });
  for (size_t e = 1; e < edges.size(); ++e) {
    if (edges[e].low != edges[e - 1].low || edges[e].high != edges[e - 1].high) continue;
    parent[find(edges[e].corner_at_low)] = find(edges[e - 1].corner_at_low);
    parent[find(edges[e].corner_at_high)] = find(edges[e - 1].corner_at_high);
  }
  MeshSubset part;
  ControlMesh& split = part.mesh;
  std::vector<int>& source = part.source_vertex;
  split.faces.resize(3, mesh.faces.cols());
  std::vector<int> vertex_of_fan(corner_count, -1);
  for (int c = 0; c < corner_count; ++c) {
    int& vertex = vertex_of_fan[find(c)];
    if (vertex < 0) {
      vertex = static_cast<int>(source.size());
      source.push_back(mesh.faces(c % 3, c / 3));
    }
    split.faces(c % 3, c / 3) = vertex;
  }
  split.vertices.resize(3, static_cast<int64_t>(source.size()));
  for (size_t v = 0; v < source.size(); ++v) split.vertices.col(v) = mesh.vertices.col(source[v]);
  return part;
}

MeshSubset KeepFaces(const ControlMesh& mesh, const std::vector<uint8_t>& keep_face) {
  ControlMesh kept;
  kept.vertices = mesh.vertices;
  kept.faces.resize(3, std::count(keep_face.begin(), keep_face.end(), 1));
  int next = 0;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    if (keep_face[f] != 0) kept.faces.col(next++) = mesh.faces.col(f);
  }
  return SplitFans(kept);
}

}  // namespace rilievo
