// Triangles and quads that change into each other while all stay a manifold.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// What a flat corner is worth, in squared valences.
inline constexpr int kFlatCorner = 6;

// A polygon of three or four corners, counter-clockwise.
struct Polygon {
  std::array<int, 4> corners{};
  int size = 0;  // 0: gone
  int At(int i) const { return corners[static_cast<size_t>(i % size)]; }
  // The side that runs from `from` to `to`; the polygon has it.
  int SideFrom(int from) const {
    int i = 0;
    while (corners[static_cast<size_t>(i)] != from) ++i;
    return i;
  }
};

class PolygonSet {
 public:
  // The triangles of a manifold, with its creases.
  explicit PolygonSet(const ControlMesh& mesh);

  int size() const { return static_cast<int>(polygons_.size()); }
  const Polygon& operator[](int p) const { return polygons_[static_cast<size_t>(p)]; }
  int vertex_count() const { return static_cast<int>(points_.size()); }
  const Eigen::Vector3d& Point(int v) const { return points_[static_cast<size_t>(v)]; }
  int Valence(int v) const { return valence_[static_cast<size_t>(v)]; }  // edges
  bool OnBoundary(int v) const { return boundary_[static_cast<size_t>(v)] != 0; }
  // Has a crease, or is a corner.
  bool IsSharp(int v) const { return sharp_[static_cast<size_t>(v)] != 0; }

  // The polygon that has the side from `from` to `to`, or -1.
  int WithSide(int from, int to) const;
  bool HasEdge(int a, int b) const { return WithSide(a, b) >= 0 || WithSide(b, a) >= 0; }
  bool IsCrease(int a, int b) const { return creases_.contains(Key(a, b)); }

  void Remove(int polygon);
  int Add(std::span<const int> corners);
  // A new vertex in the middle of an edge, whose halves are as sharp as it was. The polygons with
  // that edge are the caller's to replace.
  int SplitEdge(int a, int b);

  bool IsSharpEdge(int from, int to) const { return IsCrease(from, to) || WithSide(to, from) < 0; }

  // What the squared distances of the valences from the ideal, 4 and on the boundary 3, change when
  // an edge goes at some vertices and one comes at others.
  int ValenceChange(std::span<const int> less, std::span<const int> more) const;

  // Once all are quads: two triangles each, cut along the shorter diagonal where no other edge
  // joins its ends. Vertices without a polygon go. `corners`: of the mesh it was made of. None
  // where a quad has no diagonal of its own.
  std::optional<ControlMesh> ToControlMesh(const std::vector<int>& corners) const;

 private:
  static uint64_t Key(int from, int to) {
    return uint64_t{static_cast<uint32_t>(from)} << 32 | static_cast<uint32_t>(to);
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<int> valence_;
  std::vector<uint8_t> boundary_, sharp_;
  std::vector<Polygon> polygons_;
  std::unordered_map<uint64_t, int> side_;       // polygon by side
  std::unordered_map<uint64_t, float> creases_;  // sharpness, in both directions
};

// The least of the sines of a quad's corners, seen along its normal: 1 for a rectangle, 0 or less
// where it is not convex. Of four points, counter-clockwise.
double SquarenessOf(const PolygonSet& polygons, const std::array<int, 4>& quad);

// Whether a crease or the boundary runs on through that corner of a quad, more than 120 degrees
// wide: the surface is crowded there (quad_masks.h, k = 1). Its sides at the corner are in the set.
bool IsFlatCorner(const PolygonSet& polygons, const std::array<int, 4>& quad, size_t corner);

// The cosine of the angle between the normals of two quads or triangles.
double CosineBetween(const PolygonSet& polygons, std::span<const int> a, std::span<const int> b);

}  // namespace rilievo
