// On which side of a plane a point lies, and which of two planes an edge meets first: exact, and
// never undecided.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace rilievo {

// A vertex on an integer grid, within kMostGridCoordinate of 0. All predicates answer as if it were
// moved by an infinitesimal e in a direction of its own, which `id` gives; so no four points lie in
// a plane (H. Edelsbrunner and E. Muecke, "Simulation of simplicity", ACM TOG 9(1), 1990; with
// directions by chance in the place of powers of e).
struct GridPoint {
  std::array<int64_t, 3> at;
  uint32_t id;

  Eigen::Vector3d position() const {
    return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
  }
};
inline constexpr int64_t kMostGridCoordinate = int64_t{1} << 39;

using GridTriangle = std::array<GridPoint, 3>;

// 1 where `point` is on the side from which the triangle is counter-clockwise, else -1.
int SideOf(const GridTriangle& triangle, const GridPoint& point);

// Whether the edge from p to q meets the triangle.
bool Meets(const GridPoint& p, const GridPoint& q, const GridTriangle& triangle);

// Where an edge meets the planes of triangles that separate its ends.
class EdgeCrossing {
 public:
  EdgeCrossing(const GridPoint& p, const GridPoint& q, const GridTriangle& triangle);

  // In lengths of the edge, from p; within [0, 1].
  double parameter() const { return parameter_; }
  // Of two crossings of the same edge, in the same direction: which comes first.
  bool Before(const EdgeCrossing& other) const;

 private:
  // Six times the volumes between the triangle and p, and q, without sign: by power of e.
  using Volumes = std::array<__int128, 4>;
  Volumes to_p_, to_q_;
  double parameter_;
};

}  // namespace rilievo
