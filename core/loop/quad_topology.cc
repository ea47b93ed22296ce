#include "core/loop/quad_topology.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/loop/child_edges.h"

namespace rilievo {
namespace {

std::string DiagonalName(const std::array<int, 2>& ends) {
  return absl::StrCat("diagonal ", ends[0], "-", ends[1]);
}

absl::StatusOr<QuadLevel> QuadsOfControl(const ControlMesh& mesh, const MeshTopology& topology) {
  QuadLevel quads;
  RILIEVO_ASSIGN_OR_RETURN(quads.diagonal, FlagsOfDiagonals(mesh, topology));
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(mesh, topology));
  quads.sharpness.assign(topology.edge_count(), 0.0f);
  for (const SharpEdge& sharp : creases.edges) {
    quads.sharpness[sharp.edge] = sharp.sharpness;
  }
  return quads;
}

QuadLevel QuadsAfter(const MeshTopology& parent, const QuadLevel& quads) {
  QuadLevel fine;
  ForEachChildEdge(
      parent,
      [&](int f, int k, int /*corner*/) {
        const int edge = parent.face_edges(k, f);
        fine.diagonal.push_back(quads.diagonal[edge]);
        fine.sharpness.push_back(SharpnessOfHalves(quads.sharpness[edge]));
      },
      [&](int f, int c) {
        fine.diagonal.push_back(quads.diagonal[parent.face_edges(kNextCorner[c], f)]);
        fine.sharpness.push_back(0.0f);
      });
  return fine;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> FlagsOfDiagonals(const ControlMesh& mesh,
                                                      const MeshTopology& topology) {
  const std::vector<std::array<int, 2>>& diagonals = mesh.diagonals;
  for (size_t i = 1; i < diagonals.size(); ++i) {
    if (diagonals[i - 1] >= diagonals[i]) {
      return absl::InvalidArgumentError(
          absl::StrCat(DiagonalName(diagonals[i]), " is listed twice or out of order"));
    }
  }
  if (diagonals.empty()) return std::vector<uint8_t>();
  std::vector<uint8_t> flags(topology.edge_count(), 0), found(diagonals.size(), 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    const std::array<int, 2> ends = {topology.edge_vertices(0, e), topology.edge_vertices(1, e)};
    const auto at = std::lower_bound(diagonals.begin(), diagonals.end(), ends);
    if (at == diagonals.end() || *at != ends) continue;
    flags[e] = found[at - diagonals.begin()] = 1;
    if (topology.edge_faces(1, e) < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(DiagonalName(ends), " lies on the boundary; a quad has a face either side"));
    }
  }
  const auto missing = std::find(found.begin(), found.end(), 0);
  if (missing != found.end()) {
    return absl::InvalidArgumentError(absl::StrCat(DiagonalName(diagonals[missing - found.begin()]),
                                                   " is not an edge of the control mesh"));
  }
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto edges = topology.face_edges.col(f);
    const int count = flags[edges[0]] + flags[edges[1]] + flags[edges[2]];
    if (count != 1) {
      return absl::InvalidArgumentError(absl::StrCat("face ", f, " is half of ", count,
                                                     " quads; diagonals must pair up all faces"));
    }
  }
  return flags;
}

absl::StatusOr<QuadRefinement> RefineQuads(const ControlMesh& mesh,
                                           const std::vector<MeshTopology>& levels) {
  QuadRefinement refinement;
  if (!mesh.quads()) return refinement;
  RILIEVO_ASSIGN_OR_RETURN(QuadLevel control, QuadsOfControl(mesh, levels.front()));
  refinement.levels.push_back(std::move(control));
  refinement.corners = mesh.corners;
  for (size_t l = 0; l + 1 < levels.size(); ++l) {
    refinement.levels.push_back(QuadsAfter(levels[l], refinement.levels[l]));
  }
  return refinement;
}

Quad QuadOfFace(const MeshTopology& topology, const QuadLevel& quads, int face) {
  int k = 0;
  while (quads.diagonal[topology.face_edges(k, face)] == 0) ++k;
  Quad quad;
  quad.diagonal = topology.face_edges(k, face);
  const int across = topology.face_neighbors(k, face);
  const int j = CornerOfEdge(topology, across, quad.diagonal);
  const int after = kNextCorner[k], before = kPreviousCorner[k];
  quad.vertices = {topology.faces(after, face), topology.faces(before, face),
                   topology.faces(k, face), topology.faces(kPreviousCorner[j], across)};
  quad.edges = {topology.face_edges(after, face), topology.face_edges(before, face),
                topology.face_edges(kNextCorner[j], across),
                topology.face_edges(kPreviousCorner[j], across)};
  return quad;
}

std::vector<int> CornersOfQuads(const MeshTopology& topology, const QuadLevel& quads) {
  std::vector<int> corners;
  for (int f = 0; f < topology.face_count(); ++f) {
    const Quad quad = QuadOfFace(topology, quads, f);
    if (topology.edge_faces(0, quad.diagonal) != f) continue;
    corners.insert(corners.end(), quad.vertices.begin(), quad.vertices.end());
  }
  return corners;
}

QuadRings::QuadRings(const MeshTopology& topology, const QuadRefinement& quads, int level)
    : topology_(topology),
      quads_(quads.levels[level]),
      corners_(quads.corners),
      first_(topology.vertex_count, kNoHalfEdge) {
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      uint32_t& first = first_[topology.faces(k, f)];
      if (first != kNoHalfEdge && topology.face_neighbors(k, f) >= 0) continue;
      first = 3u * static_cast<uint32_t>(f) + static_cast<uint32_t>(k);
    }
  }
}

uint32_t QuadRings::Turned(uint32_t half_edge) const {
  const uint32_t previous = PreviousHalfEdge(half_edge);
  const int across = topology_.face_neighbors.data()[previous];
  if (across < 0) return kNoHalfEdge;
  const int corner = CornerOfEdge(topology_, across, topology_.face_edges.data()[previous]);
  return 3u * static_cast<uint32_t>(across) + static_cast<uint32_t>(corner);
}

void QuadRings::Of(int vertex, QuadRing& ring) const {
  ring.neighbors.clear();
  ring.opposite.clear();
  ring.half_edges.clear();
  ring.triangle.clear();
  ring.sharp.sharpness.clear();
  ring.sharp.boundary = topology_.boundary_vertex[vertex] != 0;
  ring.sharp.corner = std::binary_search(corners_.begin(), corners_.end(), vertex);
  const auto edge_of = [&](uint32_t h) { return topology_.face_edges.data()[h]; };
  const auto push_edge = [&](int edge, int end) {
    ring.triangle.push_back(static_cast<int>(ring.half_edges.size()));
    ring.neighbors.push_back(end);
    ring.sharp.sharpness.push_back(topology_.edge_faces(1, edge) < 0 ? kInfiniteSharpness
                                                                     : quads_.sharpness[edge]);
  };
  uint32_t first = first_[vertex];
  if (quads_.diagonal[edge_of(first)] != 0) first = Turned(first);
  for (uint32_t h = first; h != kNoHalfEdge;) {
    const uint32_t opposite = NextHalfEdge(h), last = PreviousHalfEdge(h);
    const int end = topology_.faces.data()[opposite];
    if (quads_.diagonal[edge_of(h)] != 0) {
      ring.opposite.push_back(end);
    } else {
      push_edge(edge_of(h), end);
    }
    ring.half_edges.push_back(h);
    if (quads_.diagonal[edge_of(opposite)] != 0) {
      const int across = topology_.face_neighbors.data()[opposite];
      const int corner = CornerOfEdge(topology_, across, edge_of(opposite));
      ring.opposite.push_back(topology_.faces(kPreviousCorner[corner], across));
    }
    const uint32_t next = Turned(h);
    if (next == kNoHalfEdge) push_edge(edge_of(last), topology_.faces.data()[last]);
    h = next == first ? kNoHalfEdge : next;
  }
}

NewQuadRing RingOfNewVertex(const MeshTopology& parent, const QuadLevel& quads, int edge) {
  NewQuadRing ring;
  const int count = parent.vertex_count;
  const Quad quad = QuadOfFace(parent, quads, parent.edge_faces(0, edge));
  if (quads.diagonal[edge] != 0) {
    for (int i = 0; i < 4; ++i) {
      ring.neighbors[i] = count + quad.edges[i];
      ring.neighbors[4 + i] = quad.vertices[(i + 1) % 4];
    }
    ring.size = 8;
    return ring;
  }
  const int i = quad.PlaceOfEdge(edge);
  const int from = quad.vertices[i], to = quad.vertices[(i + 1) % 4];
  const int after = count + quad.edges[(i + 1) % 4], before = count + quad.edges[(i + 3) % 4];
  const int middle = count + quad.diagonal;
  const int second = parent.edge_faces(1, edge);
  if (second < 0) {
    ring.neighbors = {to, middle, from, after, before};
    ring.size = 5;
    ring.boundary = true;
    return ring;
  }
  const Quad across = QuadOfFace(parent, quads, second);
  const int j = across.PlaceOfEdge(edge);
  ring.neighbors = {to,
                    middle,
                    from,
                    count + across.diagonal,
                    after,
                    before,
                    count + across.edges[(j + 1) % 4],
                    count + across.edges[(j + 3) % 4]};
  ring.size = 8;
  return ring;
}

}  // namespace rilievo
