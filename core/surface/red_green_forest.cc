#include "core/surface/red_green_forest.h"

namespace rilievo {

RedGreenForest::RedGreenForest(std::span<const MeshTopology> levels) : levels_(levels) {
  for (const MeshTopology& level : levels) {
    cut_.emplace_back(static_cast<size_t>(level.face_count()), uint8_t{0});
  }
}

void RedGreenForest::Cut(LevelFace at, std::vector<LevelFace>& made) {
  if (IsCut(at)) return;
  cut_[at.level][at.face] = 1;
  for (int child = 0; child < 4; ++child) made.push_back({at.level + 1, 4 * at.face + child});
  if (at.level == 0) return;
  for (int k = 0; k < 3; ++k) {
    const int neighbor = levels_[at.level].face_neighbors(k, at.face);
    if (neighbor >= 0) Cut({at.level - 1, neighbor / 4}, made);
  }
}

void RedGreenForest::ForEachLeaf(const std::function<void(LevelFace)>& visit) const {
  std::vector<LevelFace> stack;
  const int roots = levels_.empty() ? 0 : levels_.front().face_count();
  for (int root = 0; root < roots; ++root) {
    stack.push_back({0, root});
    while (!stack.empty()) {
      const LevelFace at = stack.back();
      stack.pop_back();
      if (at.level == finest_level() || !IsCut(at)) {
        visit(at);
        continue;
      }
      for (int child = 3; child >= 0; --child) stack.push_back({at.level + 1, 4 * at.face + child});
    }
  }
}

bool RedGreenForest::HasCutNeighbor(LevelFace leaf) const {
  if (leaf.level == finest_level()) return false;
  for (int k = 0; k < 3; ++k) {
    const int neighbor = levels_[leaf.level].face_neighbors(k, leaf.face);
    if (neighbor >= 0 && IsCut({leaf.level, neighbor})) return true;
  }
  return false;
}

std::array<int, 3> RedGreenForest::Corners(LevelFace at) const {
  if (at.level < finest_level()) {
    const auto face = levels_[at.level].faces.col(at.face);
    return {face[0], face[1], face[2]};
  }
  const MeshTopology& parent = levels_.back();
  const auto face = parent.faces.col(at.face / 4), edges = parent.face_edges.col(at.face / 4);
  const int ab = parent.vertex_count + edges[0], bc = parent.vertex_count + edges[1],
            ca = parent.vertex_count + edges[2];
  const std::array<std::array<int, 3>, 4> children = {
      {{face[0], ab, ca}, {ab, face[1], bc}, {ca, bc, face[2]}, {bc, ca, ab}}};
  return children[at.face % 4];
}

void RedGreenForest::TrianglesOf(LevelFace leaf, const IsShorter& is_shorter,
                                 std::vector<std::array<int, 3>>& triangles) const {
  triangles.clear();
  const std::array<int, 3> corners = Corners(leaf);
  std::array<int, 3> middle = {-1, -1, -1};  // of the sides whose neighbour is cut
  int count = 0;
  for (int k = 0; k < 3 && leaf.level < finest_level(); ++k) {
    const MeshTopology& topology = levels_[leaf.level];
    const int neighbor = topology.face_neighbors(k, leaf.face);
    if (neighbor < 0 || !IsCut({leaf.level, neighbor})) continue;
    middle[k] = topology.vertex_count + topology.face_edges(k, leaf.face);
    ++count;
  }
  // Turned so that with one middle it is on side 0, with two on sides 0 and 1.
  int first = 0;
  while (count > 0 && count < 3 && (middle[first] < 0 || middle[(first + 2) % 3] >= 0)) ++first;
  const int a = corners[first % 3], b = corners[(first + 1) % 3], c = corners[(first + 2) % 3];
  const int ab = middle[first % 3], bc = middle[(first + 1) % 3], ca = middle[(first + 2) % 3];
  switch (count) {
    case 0:
      triangles = {{a, b, c}};
      break;
    case 1:
      triangles = {{a, ab, c}, {ab, b, c}};
      break;
    case 2:
      triangles = {{ab, b, bc}};
      if (is_shorter({ab, c}, {a, bc})) {
        triangles.push_back({a, ab, c});
        triangles.push_back({ab, bc, c});
      } else {
        triangles.push_back({a, ab, bc});
        triangles.push_back({a, bc, c});
      }
      break;
    default:
      triangles = {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {bc, ca, ab}};
  }
}

}  // namespace rilievo
