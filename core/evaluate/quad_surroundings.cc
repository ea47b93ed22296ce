#include "core/evaluate/quad_surroundings.h"

#include <algorithm>
#include <utility>

#include "core/loop/quad_masks.h"
#include "core/loop/sharp_ring.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

int PlaceIn(const std::vector<int>& list, int value) {
  return static_cast<int>(std::find(list.begin(), list.end(), value) - list.begin());
}

int Wrapped(int i, size_t count) {
  const int n = static_cast<int>(count);
  return (i % n + n) % n;
}

bool IsSemiSharp(const SharpRing& ring) {
  return std::any_of(ring.sharpness.begin(), ring.sharpness.end(),
                     [](float s) { return s > 0.0f && s < kInfiniteSharpness; });
}

// Quads between the sharp edges around the one after edge `first`; two edges or more are sharp.
int QuadsOfSide(const SharpRing& ring, int first) {
  const auto sharp = [&](int i) { return ring.sharpness[Wrapped(i, ring.sharpness.size())] > 0; };
  int begin = first, end = first + 1;
  while (!sharp(begin)) --begin;
  while (!sharp(end)) ++end;
  return end - begin;
}

}  // namespace

std::array<int, 4> QuadSurroundings::CornersOf(const QuadPart& part) const {
  const Quad quad = QuadOfFace(topology_, quads_, part.face);
  std::array<int, 4> corners{};
  for (int i = 0; i < 4; ++i) corners[i] = quad.vertices[(part.turn + i) % 4];
  return corners;
}

std::optional<QuadSurroundings::Beyond> QuadSurroundings::BeyondCorner(
    const std::array<int, 4>& corners, int i, const QuadRing& ring) const {
  const int first = PlaceIn(ring.neighbors, corners[(i + 1) % 4]);
  const Vector3d here = points_.col(corners[i]);
  const auto neighbor = [&](int k) -> Vector3d {
    return points_.col(ring.neighbors[Wrapped(first + k, ring.neighbors.size())]);
  };
  const auto opposite = [&](int k) -> Vector3d {
    return points_.col(ring.opposite[Wrapped(first + k, ring.opposite.size())]);
  };
  const std::vector<int> spokes = SharpSpokes(ring.sharp);
  const VertexKind kind = KindOf(ring.sharp, spokes);
  if (kind == VertexKind::kSmooth) {
    if (ring.neighbors.size() != 4) return std::nullopt;
    return Beyond{neighbor(2), neighbor(3), opposite(2)};
  }
  const int quads = spokes.size() < 2 ? 0 : QuadsOfSide(ring.sharp, first);
  if (kind == VertexKind::kCorner && quads == 1) {
    return Beyond{2 * here - neighbor(0), 2 * here - neighbor(1),
                  4 * here - 2 * (neighbor(0) + neighbor(1)) + opposite(0)};
  }
  if (kind != VertexKind::kCrease || quads != 2) return std::nullopt;
  if (ring.sharp.sharpness[first] > 0) {
    return Beyond{neighbor(2), 2 * here - neighbor(1), 2 * neighbor(2) - opposite(1)};
  }
  return Beyond{2 * here - neighbor(0), neighbor(-1), 2 * neighbor(-1) - opposite(-1)};
}

bool QuadSurroundings::IsIrregular(const QuadPart& part, int corner) const {
  const std::array<int, 4> corners = CornersOf(part);
  QuadRing ring;
  rings_.Of(corners[corner], ring);
  for (float& sharpness : ring.sharp.sharpness) {
    if (sharpness < kInfiniteSharpness) sharpness = 0.0f;
  }
  return KindOf(ring.sharp, SharpSpokes(ring.sharp)) == VertexKind::kCorner ||
         !BeyondCorner(corners, corner, ring);
}

std::optional<QuadGrid> QuadSurroundings::GridOf(const QuadPart& part) const {
  const std::array<int, 4> corners = CornersOf(part);
  QuadRing ring;
  std::array<Beyond, 4> beyond;
  for (int i = 0; i < 4; ++i) {
    rings_.Of(corners[i], ring);
    if (IsSemiSharp(ring.sharp)) return std::nullopt;
    const std::optional<Beyond> found = BeyondCorner(corners, i, ring);
    if (!found) return std::nullopt;
    beyond[i] = *found;
  }
  QuadGrid grid;
  // Of corner i, turned by i right angles: itself, back, below, and the diagonal one.
  static constexpr std::array<std::array<std::array<int, 2>, 4>, 4> kPlaces = {
      {{{{1, 1}, {0, 1}, {1, 0}, {0, 0}}},
       {{{2, 1}, {2, 0}, {3, 1}, {3, 0}}},
       {{{2, 2}, {3, 2}, {2, 3}, {3, 3}}},
       {{{1, 2}, {1, 3}, {0, 2}, {0, 3}}}}};
  for (size_t i = 0; i < 4; ++i) {
    const auto at = [&](size_t k) -> Vector3d& {
      return grid[static_cast<size_t>(kPlaces[i][k][0])][static_cast<size_t>(kPlaces[i][k][1])];
    };
    at(0) = points_.col(corners[i]);
    at(1) = beyond[i].back;
    at(2) = beyond[i].below;
    at(3) = beyond[i].diagonal;
  }
  return grid;
}

QuadSurroundings::Corner QuadSurroundings::LimitAt(const QuadPart& part, int corner) const {
  const std::array<int, 4> corners = CornersOf(part);
  QuadRing ring;
  rings_.Of(corners[corner], ring);
  const SharpLimitMask mask = QuadLimit(ring.sharp);
  const auto sum = [&](const std::vector<double>& weights) {
    Vector3d point = weights[0] * points_.col(corners[corner]);
    size_t at = 1;
    for (const int v : ring.neighbors) point += weights[at++] * points_.col(v);
    for (const int v : ring.opposite) point += weights[at++] * points_.col(v);
    return point;
  };
  const int first = PlaceIn(ring.neighbors, corners[(corner + 1) % 4]);
  const SharpSector* side = &mask.sectors.front();
  for (const SharpSector& sector : mask.sectors) {
    if (Wrapped(first - sector.first, ring.neighbors.size()) < sector.face_count) side = &sector;
  }
  return {sum(mask.position), sum(side->tangent_u), sum(side->tangent_v)};
}

ControlMesh QuadSurroundings::CutOut(QuadPart* part, std::vector<int>* face_place) const {
  std::vector<int> faces;
  const auto take = [&](int face) {
    int& place = (*face_place)[face];
    if (place >= 0) return;
    place = static_cast<int>(faces.size());
    faces.push_back(face);
  };
  QuadRing ring;
  for (const int corner : CornersOf(*part)) {
    rings_.Of(corner, ring);
    for (const uint32_t half_edge : ring.half_edges) {
      const int face = static_cast<int>(half_edge / 3);
      take(face);
      for (int k = 0; k < 3; ++k) {  // the other half of its quad
        if (quads_.diagonal[topology_.face_edges(k, face)] != 0) {
          take(topology_.face_neighbors(k, face));
        }
      }
    }
  }
  std::sort(faces.begin(), faces.end());
  for (size_t i = 0; i < faces.size(); ++i) (*face_place)[faces[i]] = static_cast<int>(i);
  const FaceCut cut = CutConnectivity(topology_, faces, one_part_, *face_place);
  ControlMesh mesh;
  mesh.faces = cut.faces;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(cut.vertex_of.size()));
  for (size_t v = 0; v < cut.vertex_of.size(); ++v) {
    mesh.vertices.col(static_cast<Eigen::Index>(v)) = points_.col(cut.vertex_of[v]);
    if (std::binary_search(corners_.begin(), corners_.end(), cut.vertex_of[v])) {
      mesh.corners.push_back(static_cast<int>(v));
    }
  }
  for (int i = 0; i < static_cast<int>(faces.size()); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int edge = topology_.face_edges(k, faces[i]);
      const int across = topology_.face_neighbors(k, faces[i]);
      if (across >= 0 && (*face_place)[across] >= 0 && (*face_place)[across] < i) continue;
      const auto [a, b] = std::minmax(mesh.faces(k, i), mesh.faces(kNextCorner[k], i));
      if (quads_.sharpness[edge] > 0) mesh.creases.push_back({a, b, quads_.sharpness[edge]});
      if (quads_.diagonal[edge] != 0) mesh.diagonals.push_back({a, b});
    }
  }
  SortTags(&mesh.creases, &mesh.corners);
  std::sort(mesh.diagonals.begin(), mesh.diagonals.end());
  part->face = (*face_place)[part->face];
  for (const int face : faces) (*face_place)[face] = -1;
  return mesh;
}

QuadPart ChildOf(const LoopRefinement& refinement, const QuadPart& part, int child) {
  const MeshTopology& parent = refinement.levels[0];
  const MeshTopology& finer = refinement.levels[1];
  const Quad quad = QuadOfFace(parent, refinement.quads.levels[0], part.face);
  const int vertex = quad.vertices[(part.turn + child) % 4];
  const int center = parent.vertex_count + quad.diagonal;
  const auto middle = [&](int i) { return parent.vertex_count + quad.edges[(part.turn + i) % 4]; };
  // Where (s, t) is (0, 0) on the quarter.
  const std::array<int, 4> firsts = {vertex, middle(0), center, middle(3)};
  for (int half = 0; half < 2; ++half) {
    const int face = parent.edge_faces(half, quad.diagonal);
    for (int f = 4 * face; f < 4 * face + 4; ++f) {
      const Quad quarter = QuadOfFace(finer, refinement.quads.levels[1], f);
      const auto begin = quarter.vertices.begin(), end = quarter.vertices.end();
      if (std::find(begin, end, vertex) == end || std::find(begin, end, center) == end) continue;
      const auto first = std::find(begin, end, firsts[child]);
      return {f, static_cast<int>(first - begin)};
    }
  }
  return {};  // not reached: each quad has four quarters
}

}  // namespace rilievo
