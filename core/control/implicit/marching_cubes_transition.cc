#include "core/control/implicit/marching_cubes_transition.h"

#include <span>

#include "core/control/implicit/cell_polygons.h"
#include "core/control/implicit/marching_cubes.h"

namespace rilievo {
namespace {

// Places in a cell are numbered x + 3 y + 9 z, in half cells.
constexpr int kPlaces = std::tuple_size_v<FinerNodes>;
constexpr int kPlaceStride[3] = {1, 3, 9};

int PlaceOfCorner(int corner) {
  return 2 * (kPlaceStride[0] * (corner & 1) + kPlaceStride[1] * ((corner >> 1) & 1) +
              kPlaceStride[2] * (corner >> 2));
}

// One cell, with the nodes of both levels at its places.
class TransitionCell {
 public:
  TransitionCell(const std::vector<GridLevel>& levels, int level, const std::array<int, 8>& corners,
                 const FinerNodes& finer)
      : level_(level), fine_(finer) {
    coarse_.fill(-1);
    for (int c = 0; c < 8; ++c) {
      coarse_[PlaceOfCorner(c)] = corners[c];
      negative_[PlaceOfCorner(c)] = levels[level].values[corners[c]] < 0;
    }
    for (int place = 0; place < kPlaces; ++place) {
      if (fine_[place] >= 0) negative_[place] = levels[level + 1].values[fine_[place]] < 0;
    }
  }

  bool IsCrossed() const {
    const bool side = negative_[0];
    for (int place = 0; place < kPlaces; ++place) {
      if (Exists(place) && negative_[place] != side) return true;
    }
    return false;
  }

  EdgeLoops Loops() {
    for (const auto& face : kCellFaces) WalkFace(face);
    EdgeLoops loops;
    for (const std::vector<int>& polygon : polygons_.Take()) {
      if (polygon.size() < 3) continue;
      std::vector<GridEdge>& loop = loops.emplace_back();
      for (const int edge : polygon) loop.push_back(EdgeOf(edge));
    }
    return loops;
  }

 private:
  bool Exists(int place) const { return fine_[place] >= 0 || coarse_[place] >= 0; }

  // The face whole or in quarters, each with the middles of its sides that are nodes.
  void WalkFace(const int (&face)[4]) {
    int corner[4], middle[4];
    for (int k = 0; k < 4; ++k) corner[k] = PlaceOfCorner(face[k]);
    for (int k = 0; k < 4; ++k) middle[k] = (corner[k] + corner[(k + 1) % 4]) / 2;
    const int center = (corner[0] + corner[2]) / 2;
    if (Exists(center)) {
      for (int k = 0; k < 4; ++k) {
        WalkPolygon(std::array{corner[k], middle[k], center, middle[(k + 3) % 4]});
      }
      return;
    }
    std::vector<int> polygon;
    for (int k = 0; k < 4; ++k) {
      polygon.push_back(corner[k]);
      if (Exists(middle[k])) polygon.push_back(middle[k]);
    }
    WalkPolygon(polygon);
  }

  void WalkPolygon(std::span<const int> places) {
    polygons_.WalkFace(
        places, [&](int place) { return negative_[place]; }, EdgeNumber);
  }

  // An edge between two places of the cell: lower end, axis, and whether it is a whole side.
  static int EdgeNumber(int a, int b) {
    const int low = std::min(a, b), length = std::abs(a - b);
    for (int axis = 0; axis < 3; ++axis) {
      if (length == kPlaceStride[axis]) return 3 * low + axis;
      if (length == 2 * kPlaceStride[axis]) return 3 * (kPlaces + low) + axis;
    }
    return -1;
  }

  GridEdge EdgeOf(int number) const {
    const int axis = number % 3, low = number / 3 % kPlaces;
    if (number < 3 * kPlaces) {
      return {.level = level_ + 1,
              .node = fine_[low],
              .next = fine_[low + kPlaceStride[axis]],
              .axis = axis};
    }
    return {.level = level_,
            .node = coarse_[low],
            .next = coarse_[low + 2 * kPlaceStride[axis]],
            .axis = axis};
  }

  const int level_;
  std::array<int, kPlaces> coarse_;
  const FinerNodes& fine_;
  std::array<bool, kPlaces> negative_{};
  CellPolygons<6 * kPlaces> polygons_;
};

}  // namespace

bool TouchesSmallerCells(const FinerNodes& finer) {
  for (const auto& corners : kCellEdgeCorners) {
    if (finer[(PlaceOfCorner(corners[0]) + PlaceOfCorner(corners[1])) / 2] >= 0) return true;
  }
  return false;
}

EdgeLoops LoopsOfTransitionCell(const std::vector<GridLevel>& levels, int level,
                                const std::array<int, 8>& corners, const FinerNodes& finer) {
  TransitionCell cell(levels, level, corners, finer);
  return cell.IsCrossed() ? cell.Loops() : EdgeLoops();
}

}  // namespace rilievo
