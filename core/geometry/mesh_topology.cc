#include "core/geometry/mesh_topology.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/geometry/half_edges.h"

namespace rilievo {
namespace {

constexpr int64_t kMaxFaces = int64_t{1} << 30;

absl::Status CheckFaces(const Eigen::Matrix3Xi& faces, int vertex_count) {
  if (vertex_count < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("vertex_count is ", vertex_count, ", must not be negative"));
  }
  if (faces.cols() == 0) return absl::InvalidArgumentError("the mesh has no faces");
  if (faces.cols() > kMaxFaces) {
    return absl::InvalidArgumentError(absl::StrCat("the mesh has ", faces.cols(),
                                                   " faces, at most ", kMaxFaces, " are possible"));
  }
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const auto face = faces.col(f);
    for (int k = 0; k < 3; ++k) {
      if (face[k] < 0 || face[k] >= vertex_count) {
        return absl::InvalidArgumentError(absl::StrCat(
            "face ", f, " names vertex ", face[k], ", but vertices are 0 to ", vertex_count - 1));
      }
      if (face[k] == face[(k + 1) % 3]) {
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, " is degenerate: it names vertex ", face[k], " twice"));
      }
    }
  }
  return absl::OkStatus();
}

// twins[h]: the opposite half-edge, kNoHalfEdge on the boundary.
absl::StatusOr<std::vector<uint32_t>> PairHalfEdges(const Eigen::Matrix3Xi& faces,
                                                    int vertex_count) {
  std::vector<uint32_t> twins(3 * faces.cols(), kNoHalfEdge);
  absl::Status status;
  ForEachEdge(faces, vertex_count, [&](int low, int high, const HalfEdgeGroup& group) {
    if (!status.ok() || group.size() == 1) return;
    if (group.size() > 2) {
      status = absl::InvalidArgumentError(absl::StrCat(
          "edge ", low, "-", high, " is non-manifold: ", group.size(), " faces meet there (",
          group[0] / 3, ", ", group[1] / 3, ", ", group[2] / 3, group.size() > 3 ? ", ...)" : ")"));
      return;
    }
    if (Origin(faces, group[0]) == Origin(faces, group[1])) {
      status = absl::InvalidArgumentError(absl::StrCat(
          "faces ", group[0] / 3, " and ", group[1] / 3, " run along edge ", low, "-", high,
          " in the same direction: one of them must be flipped, or the surface is not orientable"));
      return;
    }
    twins[group[0]] = group[1];
    twins[group[1]] = group[0];
  });
  if (!status.ok()) return status;
  return twins;
}

// Numbers the edges in the order in which the half-edges first meet them.
void NumberEdges(const std::vector<uint32_t>& twins, MeshTopology& topology) {
  const uint32_t half_edge_count = static_cast<uint32_t>(twins.size());
  int64_t edge_count = 0;
  for (uint32_t h = 0; h < half_edge_count; ++h) edge_count += twins[h] > h;
  topology.edge_vertices.resize(2, edge_count);
  topology.edge_faces.resize(2, edge_count);
  int* const face_edges = topology.face_edges.data();
  int* const face_neighbors = topology.face_neighbors.data();
  int edge = 0;
  for (uint32_t h = 0; h < half_edge_count; ++h) {
    const uint32_t twin = twins[h];
    const int neighbor = twin == kNoHalfEdge ? -1 : static_cast<int>(twin / 3);
    face_neighbors[h] = neighbor;
    if (twin < h) {
      face_edges[h] = face_edges[twin];
      continue;
    }
    const int from = Origin(topology.faces, h), to = Origin(topology.faces, NextHalfEdge(h));
    topology.edge_vertices.col(edge) << std::min(from, to), std::max(from, to);
    topology.edge_faces.col(edge) << static_cast<int>(h / 3), neighbor;
    face_edges[h] = edge++;
  }
}

// Two faces over the same three vertices close up between them: each edge has two faces, but one
// level finer two edges join the same two vertices.
absl::Status CheckNoPillows(const MeshTopology& topology) {
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto neighbors = topology.face_neighbors.col(f);
    if (neighbors[0] < 0 || neighbors[0] != neighbors[1]) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("faces ", f, " and ", neighbors[0], " have the same three vertices"));
  }
  return absl::OkStatus();
}

// Fills `boundary_vertex` and `valence`.
void CountAtVertices(MeshTopology& topology) {
  topology.boundary_vertex.assign(topology.vertex_count, 0);
  topology.valence.assign(topology.vertex_count, 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    const bool boundary = topology.edge_faces(1, e) < 0;
    for (int end = 0; end < 2; ++end) {
      const int vertex = topology.edge_vertices(end, e);
      ++topology.valence[vertex];
      if (boundary) topology.boundary_vertex[vertex] = 1;
    }
  }
}

// One walk around a vertex over opposite half-edges must meet all of its faces.
absl::Status CheckFans(const std::vector<uint32_t>& twins, const MeshTopology& topology) {
  std::vector<uint32_t> start(topology.vertex_count, kNoHalfEdge);
  std::vector<int> faces_left(topology.vertex_count, 0);
  for (uint32_t h = 0; h < twins.size(); ++h) {
    const int vertex = Origin(topology.faces, h);
    ++faces_left[vertex];
    if (start[vertex] == kNoHalfEdge || twins[h] == kNoHalfEdge) start[vertex] = h;
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (start[v] == kNoHalfEdge) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " is used by no face"));
    }
    uint32_t h = start[v];
    do {
      --faces_left[v];
      h = twins[PreviousHalfEdge(h)];
    } while (h != kNoHalfEdge && h != start[v]);
    if (faces_left[v] != 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          "vertex ", v, " is non-manifold: its faces form more than one fan (the one of face ",
          start[v] / 3, " leaves out ", faces_left[v], " faces)"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MeshTopology> BuildMeshTopology(const Eigen::Matrix3Xi& faces, int vertex_count) {
  if (absl::Status status = CheckFaces(faces, vertex_count); !status.ok()) return status;
  absl::StatusOr<std::vector<uint32_t>> twins = PairHalfEdges(faces, vertex_count);
  if (!twins.ok()) return twins.status();
  MeshTopology topology;
  topology.vertex_count = vertex_count;
  topology.faces = faces;
  topology.face_edges.resize(3, faces.cols());
  topology.face_neighbors.resize(3, faces.cols());
  NumberEdges(*twins, topology);
  if (absl::Status status = CheckNoPillows(topology); !status.ok()) return status;
  CountAtVertices(topology);
  if (absl::Status status = CheckFans(*twins, topology); !status.ok()) return status;
  return topology;
}

std::vector<std::vector<int>> BoundaryLoops(const MeshTopology& topology) {
  // A boundary vertex of a manifold is left by exactly one boundary half-edge.
  std::vector<int> next(topology.vertex_count, -1);
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      if (topology.face_neighbors(k, f) >= 0) continue;
      next[topology.faces(k, f)] = topology.faces((k + 1) % 3, f);
    }
  }
  std::vector<std::vector<int>> loops;
  for (int start = 0; start < topology.vertex_count; ++start) {
    if (next[start] < 0) continue;
    std::vector<int>& loop = loops.emplace_back();
    for (int v = start; next[v] >= 0;) {
      loop.push_back(v);
      v = std::exchange(next[v], -1);
    }
  }
  return loops;
}

VertexRings BuildVertexRings(const MeshTopology& topology) {
  VertexRings rings;
  rings.neighbor_begin.assign(topology.vertex_count + 1, 0);
  for (int v = 0; v < topology.vertex_count; ++v) {
    rings.neighbor_begin[v + 1] = rings.neighbor_begin[v] + topology.valence[v];
  }
  rings.neighbors.resize(rings.neighbor_begin.back());
  // The face and corner each ring starts at.
  std::vector<int> start(topology.vertex_count, -1);
  std::vector<uint8_t> start_corner(topology.vertex_count, 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = topology.faces(k, f);
      if (start[v] >= 0 && topology.face_neighbors(k, f) >= 0) continue;
      start[v] = f;
      start_corner[v] = static_cast<uint8_t>(k);
    }
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    int f = start[v], k = start_corner[v];
    for (int i = rings.neighbor_begin[v]; i < rings.neighbor_begin[v + 1]; ++i) {
      rings.neighbors[i] = topology.faces((k + 1) % 3, f);
      const int incoming = (k + 2) % 3;
      const int across = topology.face_neighbors(incoming, f);
      if (across < 0) {
        rings.neighbors[i + 1] = topology.faces(incoming, f);
        break;
      }
      f = across;
      k = topology.faces(0, f) == v ? 0 : topology.faces(1, f) == v ? 1 : 2;
    }
  }
  return rings;
}

}  // namespace rilievo
