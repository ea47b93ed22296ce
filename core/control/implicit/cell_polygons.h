// The zero set within a cell of marching cubes.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace rilievo {

// The polygons of the zero set in a cell, put together face by face from numbered edges of it.
template <size_t kEdges>
class CellPolygons {
 public:
  CellPolygons() { next_.fill(-1); }

  // `corners`: of a face, counter-clockwise seen from outside. For each run of negative corners a
  // segment joins the edge where the run ends to the edge where it began, so that two runs on one
  // face stay apart. `edge_between`: the number of an edge by its ends.
  template <typename IsNegative, typename EdgeBetween>
  void WalkFace(std::span<const int> corners, const IsNegative& is_negative,
                const EdgeBetween& edge_between) {
    const size_t size = corners.size();
    const auto at = [&](size_t k) { return corners[k % size]; };
    for (size_t k = 0; k < size; ++k) {
      if (!is_negative(at(k)) || is_negative(at(k + 1))) continue;
      size_t start = k + size;
      while (is_negative(at(start - 1))) --start;
      next_[edge_between(at(k), at(k + 1))] = edge_between(at(start - 1), at(start));
    }
  }

  // Clockwise seen from the positive side; none is left.
  std::vector<std::vector<int>> Take() {
    std::vector<std::vector<int>> polygons;
    for (size_t edge = 0; edge < kEdges; ++edge) {
      if (next_[edge] < 0) continue;
      std::vector<int>& polygon = polygons.emplace_back();
      for (auto e = static_cast<int>(edge); next_[e] >= 0;) {
        polygon.push_back(e);
        e = std::exchange(next_[e], -1);
      }
    }
    return polygons;
  }

 private:
  std::array<int, kEdges> next_;  // the edge that follows each
};

}  // namespace rilievo
