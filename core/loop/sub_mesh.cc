#include "core/loop/sub_mesh.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

// Corners of the taken faces, joined where faces meet in an edge.
class CornerSets {
 public:
  explicit CornerSets(size_t faces) : parent_(3 * faces) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Root(int corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  void Join(int a, int b) {
    a = Root(a), b = Root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

// The marked faces and the other halves of their quads.
std::vector<uint8_t> WholeQuads(const MeshTopology& topology, const std::vector<uint8_t>& diagonal,
                                std::vector<uint8_t> marked) {
  for (int e = 0; e < static_cast<int>(diagonal.size()); ++e) {
    if (diagonal[e] == 0) continue;
    const int a = topology.edge_faces(0, e), b = topology.edge_faces(1, e);
    marked[a] = marked[b] = marked[a] | marked[b];
  }
  return marked;
}

}  // namespace

FaceCut CutConnectivity(const MeshTopology& topology, const std::vector<int>& faces,
                        const std::vector<int>& part, const std::vector<int>& place) {
  const int count = static_cast<int>(faces.size());
  CornerSets sets(faces.size());
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const int f = faces[i], neighbor = topology.face_neighbors(k, f);
      if (neighbor < 0 || part[neighbor] != part[f] || place[neighbor] < i) continue;
      const int j = CornerOfEdge(topology, neighbor, topology.face_edges(k, f));
      sets.Join(3 * i + k, 3 * place[neighbor] + (j + 1) % 3);
      sets.Join(3 * i + (k + 1) % 3, 3 * place[neighbor] + j);
    }
  }
  FaceCut cut;
  std::vector<int> number(3 * faces.size(), -1);
  cut.faces.resize(3, count);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      int& vertex = number[sets.Root(3 * i + k)];
      if (vertex < 0) {
        vertex = static_cast<int>(cut.vertex_of.size());
        cut.vertex_of.push_back(topology.faces(k, faces[i]));
      }
      cut.faces(k, i) = vertex;
    }
  }
  return cut;
}

std::vector<uint8_t> WithTouchingFaces(const MeshTopology& topology,
                                       const std::vector<uint8_t>& marked) {
  std::vector<uint8_t> near(topology.vertex_count, 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    if (marked[f] == 0) continue;
    for (int k = 0; k < 3; ++k) near[topology.faces(k, f)] = 1;
  }
  std::vector<uint8_t> grown(topology.face_count(), 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto face = topology.faces.col(f);
    grown[f] = near[face[0]] | near[face[1]] | near[face[2]];
  }
  return grown;
}

SubMesh CutFacesOut(const MeshTopology& topology, const Eigen::Matrix3Xd& points,
                    const std::vector<uint8_t>& wanted, const std::vector<SharpEdge>& sharp,
                    const std::vector<int>& corners, const std::vector<uint8_t>& diagonal) {
  SubMesh sub;
  const std::vector<uint8_t> taken = WholeQuads(
      topology, diagonal, WithTouchingFaces(topology, WholeQuads(topology, diagonal, wanted)));
  for (int f = 0; f < topology.face_count(); ++f) {
    if (taken[f] != 0) sub.faces.push_back(f);
  }
  const int count = static_cast<int>(sub.faces.size());
  std::vector<int> place(topology.face_count(), -1);
  for (int i = 0; i < count; ++i) place[sub.faces[i]] = i;
  const std::vector<int> part(taken.begin(), taken.end());
  FaceCut cut = CutConnectivity(topology, sub.faces, part, place);
  sub.mesh.faces = std::move(cut.faces);
  const std::vector<int>& source = cut.vertex_of;
  sub.mesh.vertices.resize(3, static_cast<Eigen::Index>(source.size()));
  for (size_t v = 0; v < source.size(); ++v) {
    sub.mesh.vertices.col(static_cast<Eigen::Index>(v)) = points.col(source[v]);
    if (std::binary_search(corners.begin(), corners.end(), source[v])) {
      sub.mesh.corners.push_back(static_cast<int>(v));
    }
  }
  std::vector<float> sharpness(topology.edge_count(), 0.0f);
  for (const SharpEdge& edge : sharp) sharpness[edge.edge] = edge.sharpness;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const int edge = topology.face_edges(k, sub.faces[i]);
      const float tag = sharpness[edge];
      const int neighbor = topology.face_neighbors(k, sub.faces[i]);
      if (neighbor >= 0 && place[neighbor] >= 0 && place[neighbor] < i) continue;
      const auto [a, b] = std::minmax(sub.mesh.faces(k, i), sub.mesh.faces((k + 1) % 3, i));
      if (tag > 0) sub.mesh.creases.push_back({a, b, tag});
      if (!diagonal.empty() && diagonal[edge] != 0) sub.mesh.diagonals.push_back({a, b});
    }
  }
  std::sort(sub.mesh.creases.begin(), sub.mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  std::sort(sub.mesh.diagonals.begin(), sub.mesh.diagonals.end());
  return sub;
}

}  // namespace rilievo
