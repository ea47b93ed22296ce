#include "core/control/topology/mesh_subset.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "core/geometry/half_edges.h"

namespace rilievo {
namespace {

// Of the corners of the faces, in the order of the index list: those of one vertex that share an
// edge belong to one fan, which its first corner stands for.
DisjointSets FansOf(const Eigen::Matrix3Xi& faces, int vertex_count) {
  DisjointSets fans(static_cast<size_t>(faces.size()));
  ForEachEdge(faces, vertex_count, [&](int low, int /*high*/, const HalfEdgeGroup& group) {
    const auto at_low = [&](uint32_t h) { return Origin(faces, h) == low ? h : NextHalfEdge(h); };
    const auto at_high = [&](uint32_t h) { return Origin(faces, h) == low ? NextHalfEdge(h) : h; };
    for (size_t i = 1; i < group.size(); ++i) {
      fans.Unite(at_low(group[0]), at_low(group[i]));
      fans.Unite(at_high(group[0]), at_high(group[i]));
    }
  });
  return fans;
}

MeshSubset SplitFans(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xi faces) {
  MeshSubset part;
  DisjointSets fans = FansOf(faces, static_cast<int>(vertices.cols()));
  int* const corners = faces.data();
  for (uint32_t c = 0; c < static_cast<uint32_t>(faces.size()); ++c) {
    const uint32_t first = fans.Find(c);
    if (first == c) {
      part.source_vertex.push_back(corners[c]);
      corners[c] = static_cast<int>(part.source_vertex.size()) - 1;
    } else {
      corners[c] = corners[first];
    }
  }
  part.mesh.faces = std::move(faces);
  part.mesh.vertices = vertices(Eigen::all, part.source_vertex);
  return part;
}

void CarryTags(const ControlMesh& mesh, MeshSubset* part) {
  const std::vector<int>& source = part->source_vertex;
  const auto count = static_cast<int>(source.size());
  for (int v = 0; v < count; ++v) {
    if (std::ranges::binary_search(mesh.corners, source[v])) part->mesh.corners.push_back(v);
  }
  if (mesh.creases.empty() && mesh.diagonals.empty()) return;
  std::map<std::pair<int, int>, float> sharpness;
  for (const Crease& crease : mesh.creases) sharpness[{crease.a, crease.b}] = crease.sharpness;
  ForEachEdge(part->mesh.faces, count, [&](int low, int high, const HalfEdgeGroup& group) {
    const auto [a, b] = std::minmax(source[low], source[high]);
    const auto crease = sharpness.find({a, b});
    if (crease != sharpness.end()) part->mesh.creases.push_back({low, high, crease->second});
    if (group.size() > 1 && std::ranges::binary_search(mesh.diagonals, std::array{a, b})) {
      part->mesh.diagonals.push_back({low, high});
    }
  });
}

}  // namespace

MeshSubset SplitFans(const ControlMesh& mesh) { return SplitFans(mesh.vertices, mesh.faces); }

DisjointSets JoinedVertices(const Eigen::Matrix3Xi& faces, int vertex_count) {
  DisjointSets joined(static_cast<size_t>(vertex_count));
  for (const auto face : faces.colwise()) {
    joined.Unite(face[0], face[1]);
    joined.Unite(face[0], face[2]);
  }
  return joined;
}

MeshSubset KeepFaces(const ControlMesh& mesh, const std::vector<uint8_t>& keep_face) {
  Eigen::Matrix3Xi kept(3, std::count(keep_face.begin(), keep_face.end(), 1));
  int next = 0;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    if (keep_face[f] != 0) kept.col(next++) = mesh.faces.col(f);
  }
  MeshSubset part = SplitFans(mesh.vertices, std::move(kept));
  CarryTags(mesh, &part);
  return part;
}

}  // namespace rilievo
