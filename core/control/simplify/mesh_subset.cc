#include "core/control/simplify/mesh_subset.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/geometry/half_edges.h"

namespace rilievo {
namespace {

// Per corner of the faces, in the order of the index list: the first corner of its fan. Corners of
// one vertex that share an edge belong to one fan.
std::vector<int> FirstCornersOfFans(const Eigen::Matrix3Xi& faces, int vertex_count) {
  std::vector<int> parents(static_cast<size_t>(faces.size()));
  std::iota(parents.begin(), parents.end(), 0);
  const auto find = [&](int corner) {
    while (parents[corner] != corner) corner = parents[corner] = parents[parents[corner]];
    return corner;
  };
  const auto unite = [&](uint32_t a, uint32_t b) {
    const auto [first, second] =
        std::minmax({find(static_cast<int>(a)), find(static_cast<int>(b))});
    parents[second] = first;
  };
  ForEachEdge(faces, vertex_count, [&](int low, int /*high*/, const HalfEdgeGroup& group) {
    const auto at_low = [&](uint32_t h) { return Origin(faces, h) == low ? h : NextHalfEdge(h); };
    const auto at_high = [&](uint32_t h) { return Origin(faces, h) == low ? NextHalfEdge(h) : h; };
    for (size_t i = 1; i < group.size(); ++i) {
      unite(at_low(group[0]), at_low(group[i]));
      unite(at_high(group[0]), at_high(group[i]));
    }
  });
  // A corner's parent is never behind it, so its own parent is a first corner by then.
  for (int& parent : parents) parent = parents[parent];
  return parents;
}

MeshSubset SplitFans(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xi faces) {
  MeshSubset part;
  const std::vector<int> first = FirstCornersOfFans(faces, static_cast<int>(vertices.cols()));
  int* const corners = faces.data();
  for (int c = 0; c < static_cast<int>(first.size()); ++c) {
    if (first[c] == c) {
      part.source_vertex.push_back(corners[c]);
      corners[c] = static_cast<int>(part.source_vertex.size()) - 1;
    } else {
      corners[c] = corners[first[c]];
    }
  }
  part.mesh.faces = std::move(faces);
  part.mesh.vertices = vertices(Eigen::all, part.source_vertex);
  return part;
}

}  // namespace

MeshSubset SplitFans(const ControlMesh& mesh) { return SplitFans(mesh.vertices, mesh.faces); }

MeshSubset KeepFaces(const ControlMesh& mesh, const std::vector<uint8_t>& keep_face) {
  Eigen::Matrix3Xi kept(3, std::count(keep_face.begin(), keep_face.end(), 1));
  int next = 0;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    if (keep_face[f] != 0) kept.col(next++) = mesh.faces.col(f);
  }
  return SplitFans(mesh.vertices, std::move(kept));
}

}  // namespace rilievo
