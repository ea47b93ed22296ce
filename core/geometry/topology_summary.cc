#include <algorithm>
#include <utility>

#include "core/geometry/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

bool Counts(const Eigen::Matrix3Xi& faces, Eigen::Index f, int vertex_count) {
  const auto face = faces.col(f);
  return face.minCoeff() >= 0 && face.maxCoeff() < vertex_count && face[0] != face[1] &&
         face[1] != face[2] && face[2] != face[0];
}

// The faces without those that name a vertex out of range or twice.
Eigen::Matrix3Xi CountedFaces(const Eigen::Matrix3Xi& faces, int vertex_count) {
  Eigen::Matrix3Xi counted(3, faces.cols());
  Eigen::Index size = 0;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    if (Counts(faces, f, vertex_count)) counted.col(size++) = faces.col(f);
  }
  counted.conservativeResize(3, size);
  return counted;
}

// The corner of `vertex` at an end of half-edge h.
uint32_t CornerAt(const Eigen::Matrix3Xi& faces, uint32_t h, int vertex) {
  return Origin(faces, h) == vertex ? h : NextHalfEdge(h);
}

// A loop is a chain of boundary edges in which each fan of faces joins exactly two of them.
int64_t CountBoundaryLoops(const std::vector<uint32_t>& boundary_half_edges, DisjointSets& fans) {
  const uint32_t count = static_cast<uint32_t>(boundary_half_edges.size());
  std::vector<std::pair<uint32_t, uint32_t>> ends;  // fan, boundary edge
  ends.reserve(2 * boundary_half_edges.size());
  for (uint32_t b = 0; b < count; ++b) {
    ends.emplace_back(fans.Find(boundary_half_edges[b]), b);
    ends.emplace_back(fans.Find(NextHalfEdge(boundary_half_edges[b])), b);
  }
  std::sort(ends.begin(), ends.end());
  DisjointSets chains(count);
  std::vector<uint8_t> open(count, 0);
  for (size_t begin = 0, end = 0; begin < ends.size(); begin = end) {
    while (end < ends.size() && ends[end].first == ends[begin].first) ++end;
    for (size_t i = begin; i < end; ++i) {
      chains.Unite(ends[begin].second, ends[i].second);
      if (end - begin != 2) open[ends[i].second] = 1;
    }
  }
  std::vector<uint8_t> open_chain(count, 0);
  for (uint32_t b = 0; b < count; ++b) open_chain[chains.Find(b)] |= open[b];
  int64_t loops = 0;
  for (uint32_t b = 0; b < count; ++b) loops += chains.Find(b) == b && !open_chain[b];
  return loops;
}

bool RunsTwiceTheSameWay(const Eigen::Matrix3Xi& faces, const HalfEdgeGroup& group) {
  return group.size() > 2 ||
         (group.size() == 2 && Origin(faces, group[0]) == Origin(faces, group[1]));
}

TopologySummary Summarize(const Eigen::Matrix3Xi& faces, int vertex_count) {
  TopologySummary summary;
  summary.faces = faces.cols();
  DisjointSets components(static_cast<size_t>(vertex_count));
  DisjointSets fans(static_cast<size_t>(3 * faces.cols()));
  std::vector<uint32_t> boundary_half_edges;
  ForEachEdge(faces, vertex_count, [&](int low, int high, const HalfEdgeGroup& group) {
    ++summary.edges;
    if (group.size() == 1) boundary_half_edges.push_back(group[0]);
    if (group.size() > 2) ++summary.nonmanifold_edges;
    if (RunsTwiceTheSameWay(faces, group)) summary.oriented = false;
    components.Unite(static_cast<uint32_t>(low), static_cast<uint32_t>(high));
    for (size_t i = 1; i < group.size(); ++i) {
      fans.Unite(CornerAt(faces, group[0], low), CornerAt(faces, group[i], low));
      fans.Unite(CornerAt(faces, group[0], high), CornerAt(faces, group[i], high));
    }
  });
  std::vector<int> fan_count(static_cast<size_t>(vertex_count), 0);
  for (uint32_t h = 0; h < 3 * faces.cols(); ++h) {
    fan_count[Origin(faces, h)] += fans.Find(h) == h;
  }
  for (uint32_t v = 0; v < fan_count.size(); ++v) {
    summary.vertices += fan_count[v] > 0;
    summary.nonmanifold_vertices += fan_count[v] > 1;
    summary.components += fan_count[v] > 0 && components.Find(v) == v;
  }
  summary.boundary_edges = static_cast<int64_t>(boundary_half_edges.size());
  summary.boundary_loops = CountBoundaryLoops(boundary_half_edges, fans);
  summary.euler = summary.vertices - summary.edges + summary.faces;
  summary.genus = (2 * summary.components - summary.boundary_loops - summary.euler) / 2;
  return summary;
}

}  // namespace

TopologySummary SummarizeTopology(const Eigen::Matrix3Xi& faces, int vertex_count) {
  vertex_count = std::max(vertex_count, 0);
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    if (!Counts(faces, f, vertex_count)) {
      return Summarize(CountedFaces(faces, vertex_count), vertex_count);
    }
  }
  return Summarize(faces, vertex_count);
}

int64_t Genus(const MeshTopology& topology) {
  DisjointSets components(static_cast<size_t>(topology.vertex_count));
  for (int e = 0; e < topology.edge_count(); ++e) {
    components.Unite(static_cast<uint32_t>(topology.edge_vertices(0, e)),
                     static_cast<uint32_t>(topology.edge_vertices(1, e)));
  }
  int64_t component_count = 0;
  for (uint32_t v = 0; v < static_cast<uint32_t>(topology.vertex_count); ++v) {
    component_count += components.Find(v) == v;
  }
  const int64_t euler =
      int64_t{topology.vertex_count} - topology.edge_count() + topology.face_count();
  return (2 * component_count - static_cast<int64_t>(BoundaryLoops(topology).size()) - euler) / 2;
}

}  // namespace rilievo
