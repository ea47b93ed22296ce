#include "core/loop/sharp_refinement.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

// The edges around sharp vertices of one level, counter-clockwise, one vertex after the other.
struct SharpRings {
  std::vector<int> vertices;
  std::vector<uint8_t> boundary, corner;
  std::vector<int> begin = {0};
  std::vector<int> edges;
  std::vector<float> sharpness;

  int size() const { return static_cast<int>(vertices.size()); }
  void Push(int edge, float edge_sharpness) {
    edges.push_back(edge);
    sharpness.push_back(edge_sharpness);
  }
  void EndRing(int vertex, bool on_boundary, bool is_corner) {
    vertices.push_back(vertex);
    boundary.push_back(on_boundary);
    corner.push_back(is_corner);
    begin.push_back(static_cast<int>(edges.size()));
  }
  SharpRing Ring(int i) const {
    return {{sharpness.begin() + begin[i], sharpness.begin() + begin[i + 1]},
            boundary[i] != 0,
            corner[i] != 0};
  }
};

int OtherEnd(const MeshTopology& topology, int edge, int vertex) {
  return topology.edge_vertices(0, edge) + topology.edge_vertices(1, edge) - vertex;
}

std::vector<uint8_t> SharpVertexFlags(const ControlMesh& mesh, const MeshTopology& control,
                                      const CreaseTopology& creases) {
  std::vector<uint8_t> flags(control.vertex_count, 0);
  for (const SharpEdge& sharp : creases.edges) {
    for (int end = 0; end < 2; ++end) flags[control.edge_vertices(end, sharp.edge)] = 1;
  }
  for (int corner : mesh.corners) flags[corner] = 1;
  return flags;
}

// A half-edge that leaves each flagged vertex: on the boundary the outgoing boundary half-edge.
std::vector<uint32_t> FirstHalfEdges(const MeshTopology& control,
                                     const std::vector<uint8_t>& flags) {
  std::vector<uint32_t> first(control.vertex_count, kNoHalfEdge);
  for (int f = 0; f < control.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = control.faces(k, f);
      if (!flags[v] || (first[v] != kNoHalfEdge && control.face_neighbors(k, f) >= 0)) continue;
      first[v] = 3u * static_cast<uint32_t>(f) + static_cast<uint32_t>(k);
    }
  }
  return first;
}

// Walks around the vertex that half-edge `first` leaves. Calls visit(edge) for each edge, and
// collects the corners between them.
template <typename Visit>
std::vector<uint32_t> WalkAround(const MeshTopology& control, uint32_t first, const Visit& visit) {
  std::vector<uint32_t> half_edges;
  uint32_t h = first;
  do {
    half_edges.push_back(h);
    visit(control.face_edges.data()[h]);
    const uint32_t previous = PreviousHalfEdge(h);
    const int edge = control.face_edges.data()[previous];
    const int across = control.face_neighbors.data()[previous];
    if (across < 0) {
      visit(edge);
      break;
    }
    h = 3u * static_cast<uint32_t>(across) +
        static_cast<uint32_t>(CornerOfEdge(control, across, edge));
  } while (h != first);
  return half_edges;
}

// The half of `edge` at `vertex`; the children's numbering is stated in refinement.h.
int HalfAt(const MeshTopology& parent, const MeshTopology& fine, int edge, int vertex) {
  const int f = parent.edge_faces(0, edge), k = CornerOfEdge(parent, f, edge);
  return parent.faces(k, f) == vertex ? fine.face_edges(k, 4 * f + k)
                                      : fine.face_edges(k, 4 * f + kNextCorner[k]);
}

// The edge that cuts corner c off face f.
int InnerEdge(const MeshTopology& fine, int f, int c) {
  return fine.face_edges(kNextCorner[c], 4 * f + c);
}

// Ends the ring of the vertex on a sharp interior edge, in the order of RingOfEdgeVertex.
void PushEdgeVertex(const MeshTopology& parent, const MeshTopology& fine, const SharpEdge& sharp,
                    SharpRings& rings) {
  const int e = sharp.edge;
  const float halves = SharpnessOfHalves(sharp.sharpness);
  const int first = parent.edge_faces(0, e), second = parent.edge_faces(1, e);
  const int k = CornerOfEdge(parent, first, e), j = CornerOfEdge(parent, second, e);
  rings.Push(HalfAt(parent, fine, e, parent.faces(kNextCorner[k], first)), halves);
  rings.Push(InnerEdge(fine, first, kNextCorner[k]), 0.0f);
  rings.Push(InnerEdge(fine, first, k), 0.0f);
  rings.Push(HalfAt(parent, fine, e, parent.faces(k, first)), halves);
  rings.Push(InnerEdge(fine, second, kNextCorner[j]), 0.0f);
  rings.Push(InnerEdge(fine, second, j), 0.0f);
  rings.EndRing(parent.vertex_count + e, false, false);
}

// The rings of the next level: those of the same vertices, then those of new vertices on edges.
SharpRings RefineRings(const MeshTopology& parent, const MeshTopology& fine,
                       const std::vector<SharpEdge>& edges, SharpRings rings) {
  for (int i = 0; i < rings.size(); ++i) {
    for (int s = rings.begin[i]; s < rings.begin[i + 1]; ++s) {
      rings.edges[s] = HalfAt(parent, fine, rings.edges[s], rings.vertices[i]);
      rings.sharpness[s] = SharpnessOfHalves(rings.sharpness[s]);
    }
  }
  for (const SharpEdge& sharp : edges) {
    if (StartsSharp(sharp)) PushEdgeVertex(parent, fine, sharp, rings);
  }
  return rings;
}

std::vector<SharpEdge> RefineEdges(const MeshTopology& parent, const MeshTopology& fine,
                                   const std::vector<SharpEdge>& edges) {
  std::vector<SharpEdge> halves;
  for (const SharpEdge& sharp : edges) {
    if (!StartsSharp(sharp)) continue;
    for (int end = 0; end < 2; ++end) {
      const int vertex = parent.edge_vertices(end, sharp.edge);
      halves.push_back(
          {HalfAt(parent, fine, sharp.edge, vertex), SharpnessOfHalves(sharp.sharpness)});
    }
  }
  std::sort(halves.begin(), halves.end(),
            [](const SharpEdge& x, const SharpEdge& y) { return x.edge < y.edge; });
  return halves;
}

SharpLevel LevelOf(const MeshTopology& topology, std::vector<SharpEdge> edges,
                   const SharpRings& rings) {
  SharpLevel level;
  level.edges = std::move(edges);
  level.vertices = rings.vertices;
  level.begin.reserve(rings.vertices.size() + 1);
  for (int i = 0; i < rings.size(); ++i) {
    const int vertex = rings.vertices[i];
    const std::vector<double> weights = SharpVertexWeights(rings.Ring(i));
    level.neighbors.push_back(vertex);
    level.weights.push_back(weights[0]);
    for (size_t s = 1; s < weights.size(); ++s) {
      if (weights[s] == 0.0) continue;
      const int edge = rings.edges[rings.begin[i] + static_cast<int>(s) - 1];
      level.neighbors.push_back(OtherEnd(topology, edge, vertex));
      level.weights.push_back(weights[s]);
    }
    level.begin.push_back(static_cast<int>(level.neighbors.size()));
  }
  return level;
}

// Fills `control`, and returns the rings of those vertices.
SharpRings StartWithControlVertices(const ControlMesh& mesh, const MeshTopology& control,
                                    const CreaseTopology& creases,
                                    std::vector<SharpControlVertex>& sharp_vertices) {
  const std::vector<uint8_t> flags = SharpVertexFlags(mesh, control, creases);
  const std::vector<uint32_t> first = FirstHalfEdges(control, flags);
  SharpRings rings;
  for (int v = 0; v < control.vertex_count; ++v) {
    if (!flags[v]) continue;
    SharpControlVertex& sharp = sharp_vertices.emplace_back();
    sharp.vertex = v;
    sharp.half_edges = WalkAround(control, first[v], [&](int edge) {
      const auto tag =
          std::lower_bound(creases.edges.begin(), creases.edges.end(), edge,
                           [](const SharpEdge& x, int wanted) { return x.edge < wanted; });
      const bool tagged = tag != creases.edges.end() && tag->edge == edge;
      const bool boundary = control.edge_faces(1, edge) < 0;
      rings.Push(edge, boundary ? kInfiniteSharpness : tagged ? tag->sharpness : 0.0f);
      sharp.neighbors.push_back(OtherEnd(control, edge, v));
    });
    rings.EndRing(v, control.boundary_vertex[v],
                  std::binary_search(mesh.corners.begin(), mesh.corners.end(), v));
    sharp.limit = SharpLimit(rings.Ring(rings.size() - 1));
  }
  return rings;
}

}  // namespace

absl::StatusOr<SharpRefinement> RefineCreases(const ControlMesh& mesh,
                                              const std::vector<MeshTopology>& levels) {
  SharpRefinement sharp;
  if (mesh.creases.empty() && mesh.corners.empty()) return sharp;
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(mesh, levels.front()));
  SharpRings rings = StartWithControlVertices(mesh, levels.front(), creases, sharp.control);
  if (rings.size() == 0) {  // tags on the boundary only
    return sharp;
  }
  std::vector<SharpEdge> edges = creases.edges;
  for (size_t l = 0; l < levels.size(); ++l) {
    sharp.levels.push_back(LevelOf(levels[l], std::move(edges), rings));
    if (l + 1 == levels.size()) break;
    edges = RefineEdges(levels[l], levels[l + 1], sharp.levels[l].edges);
    rings = RefineRings(levels[l], levels[l + 1], sharp.levels[l].edges, std::move(rings));
  }
  return sharp;
}

const SharpLimitMask& SharpEdgeLimits::Of(const SharpEdge& sharp) {
  const float halves = SharpnessOfHalves(sharp.sharpness);
  if (halves != sharpness_) {
    sharpness_ = halves;
    limit_ = SharpLimit({.sharpness = {halves, 0.0f, 0.0f, halves, 0.0f, 0.0f}});
  }
  return limit_;
}

}  // namespace rilievo
