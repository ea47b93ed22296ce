#include "core/loop/crease_topology.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

bool Before(const Crease& x, const Crease& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); }

absl::Status CheckTags(const ControlMesh& mesh, int vertex_count) {
  for (size_t i = 0; i < mesh.creases.size(); ++i) {
    const Crease& crease = mesh.creases[i];
    if (crease.a < 0 || crease.b <= crease.a || crease.b >= vertex_count) {
      return absl::InvalidArgumentError(absl::StrCat("crease ", crease.a, "-", crease.b,
                                                     " must name two vertices from 0 to ",
                                                     vertex_count - 1, ", ascending"));
    }
    if (!(crease.sharpness > 0.0f)) {
      return absl::InvalidArgumentError(absl::StrCat("crease ", crease.a, "-", crease.b,
                                                     " has sharpness ", crease.sharpness,
                                                     ", must be positive"));
    }
    if (i > 0 && !Before(mesh.creases[i - 1], crease)) {
      return absl::InvalidArgumentError(
          absl::StrCat("crease ", crease.a, "-", crease.b, " is listed twice or out of order"));
    }
  }
  for (size_t i = 0; i < mesh.corners.size(); ++i) {
    const int corner = mesh.corners[i];
    if (corner < 0 || corner >= vertex_count) {
      return absl::InvalidArgumentError(
          absl::StrCat("corner ", corner, " is not a vertex, those are 0 to ", vertex_count - 1));
    }
    if (i > 0 && mesh.corners[i - 1] >= corner) {
      return absl::InvalidArgumentError(
          absl::StrCat("corner ", corner, " is listed twice or out of order"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckAgainstDiagonals(const ControlMesh& mesh) {
  for (const Crease& crease : mesh.creases) {
    if (std::binary_search(mesh.diagonals.begin(), mesh.diagonals.end(),
                           std::array{crease.a, crease.b})) {
      return absl::InvalidArgumentError(
          absl::StrCat("crease ", crease.a, "-", crease.b, " is the diagonal of a quad"));
    }
  }
  return absl::OkStatus();
}

// The tagged interior edges, ascending. Tags that are not edges of the mesh are an error.
absl::StatusOr<std::vector<SharpEdge>> FindEdges(const std::vector<Crease>& creases,
                                                 const MeshTopology& topology) {
  std::vector<SharpEdge> edges;
  if (creases.empty()) return edges;
  std::vector<uint8_t> found(creases.size(), 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    const Crease wanted = {topology.edge_vertices(0, e), topology.edge_vertices(1, e)};
    const auto at = std::lower_bound(creases.begin(), creases.end(), wanted, Before);
    if (at == creases.end() || Before(wanted, *at)) continue;
    found[at - creases.begin()] = 1;
    if (topology.edge_faces(1, e) < 0) continue;
    edges.push_back({e, std::min(at->sharpness, kInfiniteSharpness)});
  }
  const auto missing = std::find(found.begin(), found.end(), 0);
  if (missing != found.end()) {
    const Crease& crease = creases[missing - found.begin()];
    return absl::InvalidArgumentError(
        absl::StrCat("crease ", crease.a, "-", crease.b, " is not an edge of the control mesh"));
  }
  return edges;
}

std::vector<VertexKind> KindsOfVertices(const ControlMesh& mesh, const MeshTopology& topology,
                                        const std::vector<SharpEdge>& edges) {
  std::vector<int> sharp_edges(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    sharp_edges[v] = topology.boundary_vertex[v] ? 2 : 0;
  }
  for (const SharpEdge& sharp : edges) {
    for (int end = 0; end < 2; ++end) ++sharp_edges[topology.edge_vertices(end, sharp.edge)];
  }
  for (int corner : mesh.corners) sharp_edges[corner] = 3;
  std::vector<VertexKind> kinds(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    kinds[v] = static_cast<VertexKind>(std::min(sharp_edges[v], 3));
  }
  return kinds;
}

// Walks over tagged edges, each once.
class ChainWalk {
 public:
  ChainWalk(const MeshTopology& topology, const CreaseTopology& creases)
      : topology_(topology), creases_(creases), at_vertex_(topology.vertex_count, {-1, -1}) {
    for (size_t i = 0; i < creases.edges.size(); ++i) {
      for (int end = 0; end < 2; ++end) {
        const int v = topology.edge_vertices(end, creases.edges[i].edge);
        if (Ends(v)) continue;
        at_vertex_[v][at_vertex_[v][0] >= 0] = static_cast<int>(i);
      }
    }
  }

  // The chain of sharp edge `start`, which is then used up.
  CreaseChain ChainOf(size_t start) {
    const auto ends = topology_.edge_vertices.col(creases_.edges[start].edge);
    CreaseChain chain;
    Extend(start, ends[0], chain);
    chain.closed = chain.vertices.back() == ends[0] && !Ends(ends[0]);
    if (chain.closed) {
      chain.vertices.pop_back();
      return chain;
    }
    CreaseChain backward;
    Extend(start, ends[1], backward);
    std::reverse(backward.vertices.begin(), backward.vertices.end());
    std::reverse(backward.edges.begin(), backward.edges.end());
    backward.vertices.insert(backward.vertices.end(), chain.vertices.begin() + 2,
                             chain.vertices.end());
    backward.edges.insert(backward.edges.end(), chain.edges.begin() + 1, chain.edges.end());
    if (backward.vertices.front() > backward.vertices.back()) {
      std::reverse(backward.vertices.begin(), backward.vertices.end());
      std::reverse(backward.edges.begin(), backward.edges.end());
    }
    return backward;
  }

 private:
  bool Ends(int vertex) const {
    return creases_.kinds[vertex] != VertexKind::kCrease || topology_.boundary_vertex[vertex];
  }

  // From `vertex` over sharp edge `start` onwards.
  void Extend(size_t start, int vertex, CreaseChain& chain) const {
    chain.vertices.push_back(vertex);
    size_t i = start;
    do {
      const int edge = creases_.edges[i].edge;
      vertex = topology_.edge_vertices.col(edge).sum() - vertex;
      chain.edges.push_back(edge);
      chain.vertices.push_back(vertex);
      if (Ends(vertex)) return;
      const std::array<int, 2>& around = at_vertex_[vertex];
      i = static_cast<size_t>(around[around[0] == static_cast<int>(i)]);
    } while (i != start);
  }

  const MeshTopology& topology_;
  const CreaseTopology& creases_;
  std::vector<std::array<int, 2>> at_vertex_;  // the two sharp edges of inner chain vertices
};

}  // namespace

void SortTags(std::vector<Crease>* creases, std::vector<int>* corners) {
  for (Crease& crease : *creases) {
    if (crease.a > crease.b) std::swap(crease.a, crease.b);
  }
  std::stable_sort(creases->begin(), creases->end(), Before);
  const auto same = [](const Crease& p, const Crease& q) { return p.a == q.a && p.b == q.b; };
  creases->erase(std::unique(creases->begin(), creases->end(), same), creases->end());
  std::sort(corners->begin(), corners->end());
  corners->erase(std::unique(corners->begin(), corners->end()), corners->end());
}

std::vector<Crease> TaggedEdges(const MeshTopology& topology, const std::vector<uint8_t>& flags) {
  std::vector<Crease> creases;
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (flags[e] == 0) continue;
    creases.push_back({topology.edge_vertices(0, e), topology.edge_vertices(1, e)});
  }
  std::sort(creases.begin(), creases.end(), Before);
  return creases;
}

absl::StatusOr<CreaseTopology> BuildCreaseTopology(const ControlMesh& mesh,
                                                   const MeshTopology& topology) {
  RILIEVO_RETURN_IF_ERROR(CheckTags(mesh, topology.vertex_count));
  RILIEVO_RETURN_IF_ERROR(CheckAgainstDiagonals(mesh));
  CreaseTopology creases;
  RILIEVO_ASSIGN_OR_RETURN(creases.edges, FindEdges(mesh.creases, topology));
  creases.kinds = KindsOfVertices(mesh, topology, creases.edges);
  return creases;
}

std::vector<CreaseChain> CreaseChains(const MeshTopology& topology, const CreaseTopology& creases) {
  ChainWalk walk(topology, creases);
  std::vector<uint8_t> used(topology.edge_count(), 0);
  std::vector<CreaseChain> chains;
  for (size_t i = 0; i < creases.edges.size(); ++i) {
    if (used[creases.edges[i].edge]) continue;
    chains.push_back(walk.ChainOf(i));
    for (int edge : chains.back().edges) used[edge] = 1;
  }
  return chains;
}

}  // namespace rilievo
