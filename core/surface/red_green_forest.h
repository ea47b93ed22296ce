// Which faces of nested levels are cut into their children, and the triangles that are left.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

struct LevelFace {
  int level, face;
};

class RedGreenForest {
 public:
  // `levels`: nested as in LoopRefinement, all but the finest one; kept by reference. Nothing is
  // cut at first.
  explicit RedGreenForest(std::span<const MeshTopology> levels);

  int finest_level() const { return static_cast<int>(levels_.size()); }
  bool IsCut(LevelFace at) const { return cut_[at.level][at.face] != 0; }

  // Cuts a face, and coarser neighbours until faces that share an edge differ by one level at most.
  // `made` takes all children that come of it.
  void Cut(LevelFace at, std::vector<LevelFace>& made);

  // The faces that are not cut, in the order of the control faces and their children; those of the
  // finest level too.
  void ForEachLeaf(const std::function<void(LevelFace)>& visit) const;

  // The triangles of a leaf as vertices: one, or two to four where neighbours are cut. `is_shorter`
  // compares two diagonals.
  using Diagonal = std::pair<int, int>;
  using IsShorter = std::function<bool(Diagonal, Diagonal)>;
  void TrianglesOf(LevelFace leaf, const IsShorter& is_shorter,
                   std::vector<std::array<int, 3>>& triangles) const;
  // Whether a neighbour is cut.
  bool HasCutNeighbor(LevelFace leaf) const;

 private:
  std::array<int, 3> Corners(LevelFace at) const;

  std::span<const MeshTopology> levels_;
  std::vector<std::vector<uint8_t>> cut_;
};

}  // namespace rilievo
