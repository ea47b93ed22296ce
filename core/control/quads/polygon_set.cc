#include "core/control/quads/polygon_set.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <unordered_set>
#include <utility>

#include "core/control/quads/settings.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

// Newell's normal, not normalised.
Eigen::Vector3d NormalOf(const PolygonSet& polygons, std::span<const int> corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = polygons.Point(corners[0]);
  for (size_t i = 1; i + 1 < corners.size(); ++i) {
    sum += (polygons.Point(corners[i]) - origin).cross(polygons.Point(corners[i + 1]) - origin);
  }
  return sum;
}

}  // namespace

PolygonSet::PolygonSet(const ControlMesh& mesh) {
  const auto vertices = static_cast<size_t>(mesh.vertices.cols());
  points_.reserve(vertices);
  for (const auto& point : mesh.vertices.colwise()) points_.emplace_back(point);
  valence_.assign(vertices, 0);
  boundary_.assign(vertices, 0);
  sharp_.assign(vertices, 0);
  side_.reserve(static_cast<size_t>(mesh.faces.size()));
  for (const auto& face : mesh.faces.colwise()) Add(std::array{face[0], face[1], face[2]});
  for (const Crease& crease : mesh.creases) {
    creases_[Key(crease.a, crease.b)] = creases_[Key(crease.b, crease.a)] = crease.sharpness;
    for (const int end : {crease.a, crease.b}) sharp_[static_cast<size_t>(end)] = 1;
  }
  for (const int corner : mesh.corners) sharp_[static_cast<size_t>(corner)] = 1;
  for (const Polygon& polygon : polygons_) {
    for (int i = 0; i < polygon.size; ++i) {
      const int from = polygon.At(i), to = polygon.At(i + 1);
      if (WithSide(to, from) >= 0) continue;
      for (const int end : {from, to}) boundary_[static_cast<size_t>(end)] = 1;
    }
  }
}

int PolygonSet::WithSide(int from, int to) const {
  const auto found = side_.find(Key(from, to));
  return found == side_.end() ? -1 : found->second;
}

void PolygonSet::Remove(int polygon) {
  Polygon& gone = polygons_[static_cast<size_t>(polygon)];
  for (int i = 0; i < gone.size; ++i) {
    const int from = gone.At(i), to = gone.At(i + 1);
    side_.erase(Key(from, to));
    if (WithSide(to, from) >= 0) continue;
    for (const int end : {from, to}) --valence_[static_cast<size_t>(end)];
  }
  gone.size = 0;
}

int PolygonSet::Add(std::span<const int> corners) {
  const int number = size();
  Polygon& polygon = polygons_.emplace_back();
  polygon.size = static_cast<int>(corners.size());
  std::copy(corners.begin(), corners.end(), polygon.corners.begin());
  for (int i = 0; i < polygon.size; ++i) {
    const int from = polygon.At(i), to = polygon.At(i + 1);
    side_[Key(from, to)] = number;
    if (WithSide(to, from) >= 0) continue;
    for (const int end : {from, to}) ++valence_[static_cast<size_t>(end)];
  }
  return number;
}

int PolygonSet::SplitEdge(int a, int b) {
  const int middle = vertex_count();
  points_.emplace_back(0.5 * (Point(a) + Point(b)));
  valence_.push_back(0);
  const auto crease = creases_.find(Key(a, b));
  boundary_.push_back(WithSide(a, b) < 0 || WithSide(b, a) < 0 ? 1 : 0);
  sharp_.push_back(crease != creases_.end() ? 1 : 0);
  if (crease == creases_.end()) return middle;
  const float sharpness = crease->second;
  creases_.erase(Key(a, b));
  creases_.erase(Key(b, a));
  for (const int end : {a, b}) {
    creases_[Key(end, middle)] = creases_[Key(middle, end)] = sharpness;
  }
  return middle;
}

int PolygonSet::ValenceChange(std::span<const int> less, std::span<const int> more) const {
  int change = 0;
  const auto step = [&](int v, int by) {
    const int off = Valence(v) - (OnBoundary(v) ? 3 : 4);
    change += (off + by) * (off + by) - off * off;
  };
  for (const int v : less) step(v, -1);
  for (const int v : more) step(v, 1);
  return change;
}

std::optional<ControlMesh> PolygonSet::ToControlMesh(const std::vector<int>& corners) const {
  std::vector<int> number(points_.size(), -1);
  for (const Polygon& polygon : polygons_) {
    for (int i = 0; i < polygon.size; ++i) number[static_cast<size_t>(polygon.At(i))] = 0;
  }
  int vertices = 0;
  for (int& n : number) n = n < 0 ? n : vertices++;
  ControlMesh made;
  made.vertices.resize(3, vertices);
  for (size_t v = 0; v < points_.size(); ++v) {
    if (number[v] >= 0) made.vertices.col(number[v]) = points_[v];
  }
  const auto renumbered = [&](int v) { return number[static_cast<size_t>(v)]; };
  std::unordered_set<uint64_t> diagonals;
  std::vector<Eigen::Vector3i> faces;
  for (const Polygon& polygon : polygons_) {
    if (polygon.size == 0) continue;
    // Not outside of a quad that is not convex; else the shorter one.
    const auto rank = [&](int i) {
      const Eigen::Vector3d& a = Point(polygon.At(i));
      const Eigen::Vector3d& c = Point(polygon.At(i + 2));
      const Eigen::Vector3d& b = Point(polygon.At(i + 1));
      const Eigen::Vector3d& d = Point(polygon.At(i + 3));
      const bool outside = (b - a).cross(c - a).dot((c - a).cross(d - a)) <= 0;
      return std::pair(outside, (c - a).squaredNorm());
    };
    const int better = rank(1) < rank(0) ? 1 : 0;
    const auto is_taken = [&](int i) {
      const auto [a, b] = std::minmax({polygon.At(i), polygon.At(i + 2)});
      return HasEdge(a, b) || !diagonals.insert(Key(a, b)).second;
    };
    const int first = is_taken(better) ? 1 - better : better;
    if (first != better && is_taken(first)) return std::nullopt;
    std::array<int, 4> quad{};
    for (int i = 0; i < 4; ++i) quad[static_cast<size_t>(i)] = renumbered(polygon.At(first + i));
    faces.emplace_back(quad[0], quad[1], quad[2]);
    faces.emplace_back(quad[0], quad[2], quad[3]);
    made.diagonals.push_back({std::min(quad[0], quad[2]), std::max(quad[0], quad[2])});
    for (int i = 0; i < 4; ++i) {
      const auto crease = creases_.find(Key(polygon.At(i), polygon.At(i + 1)));
      if (crease == creases_.end()) continue;
      const auto [a, b] = std::minmax({renumbered(polygon.At(i)), renumbered(polygon.At(i + 1))});
      made.creases.push_back({a, b, crease->second});
    }
  }
  made.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) made.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  for (const int corner : corners) made.corners.push_back(renumbered(corner));
  std::sort(made.diagonals.begin(), made.diagonals.end());
  SortTags(&made.creases, &made.corners);
  return made;
}

double SquarenessOf(const PolygonSet& polygons, const std::array<int, 4>& quad) {
  const Eigen::Vector3d normal = NormalOf(polygons, quad).normalized();
  double least = 1.0;
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d& here = polygons.Point(quad[i]);
    const Eigen::Vector3d after = polygons.Point(quad[(i + 1) % 4]) - here;
    const Eigen::Vector3d before = polygons.Point(quad[(i + 3) % 4]) - here;
    const double lengths = after.norm() * before.norm();
    least = std::min(least, lengths > 0 ? normal.dot(after.cross(before)) / lengths : 0.0);
  }
  return least;
}

bool IsFlatCorner(const PolygonSet& polygons, const std::array<int, 4>& quad, size_t corner) {
  const int before = quad[(corner + 3) % 4], here = quad[corner], after = quad[(corner + 1) % 4];
  if (!polygons.IsSharpEdge(before, here) || !polygons.IsSharpEdge(here, after)) return false;
  const Eigen::Vector3d u = polygons.Point(before) - polygons.Point(here);
  const Eigen::Vector3d v = polygons.Point(after) - polygons.Point(here);
  return u.dot(v) < kPolygonSet.flat_cosine * u.norm() * v.norm();
}

double CosineBetween(const PolygonSet& polygons, std::span<const int> a, std::span<const int> b) {
  return NormalOf(polygons, a).normalized().dot(NormalOf(polygons, b).normalized());
}

}  // namespace rilievo
