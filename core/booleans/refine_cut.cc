#include "core/booleans/refine_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace rilievo {
namespace {

class CutRefiner {
 public:
  CutRefiner(const Eigen::Matrix2Xd& points, std::vector<CutTriangle>* triangles)
      : triangles_(*triangles) {
    for (const auto point : points.colwise()) points_.push_back(point);
    for (size_t t = 0; t < triangles_.size(); ++t) {
      for (size_t k = 0; k < 3; ++k) Register(t, k);
    }
  }

  void FlipAll() {
    for (int diagonal = 0; diagonal < static_cast<int>(sides_.size()); ++diagonal) {
      open_.push_back(diagonal);
    }
    FlipOpen();
  }

  std::vector<Eigen::Vector2d> AddPoints() {
    const size_t given = points_.size();
    Eigen::Vector2d low = points_[0], high = low;
    for (const Eigen::Vector2d& point : points_) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    FindLoops((high - low).norm());
    AddCell((low + high) / 2, (high - low).maxCoeff());
    return {points_.begin() + static_cast<std::ptrdiff_t>(given), points_.end()};
  }

 private:
  struct Side {
    size_t triangle, k;
  };

  // The two triangles of a diagonal, in any order.
  void Register(size_t t, size_t k) {
    const int diagonal = triangles_[t].diagonals[k];
    if (diagonal < 0) return;
    if (static_cast<size_t>(diagonal) >= sides_.size()) {
      sides_.resize(static_cast<size_t>(diagonal) + 1);
      counts_.resize(sides_.size(), 0);
    }
    sides_[static_cast<size_t>(diagonal)][counts_[static_cast<size_t>(diagonal)]++ % 2] = {t, k};
  }

  void Replace(int diagonal, const Side& old, const Side& now) {
    if (diagonal < 0) return;
    for (Side& side : sides_[static_cast<size_t>(diagonal)]) {
      if (side.triangle == old.triangle && side.k == old.k) {
        side = now;
        return;
      }
    }
  }

  const Eigen::Vector2d& Point(int corner) const { return points_[static_cast<size_t>(corner)]; }
  double Turn(int a, int b, int c) const {
    const Eigen::Vector2d u = Point(b) - Point(a), v = Point(c) - Point(a);
    return u.x() * v.y() - u.y() * v.x();
  }
  // Cotangent of the angle at c.
  double Cotangent(int a, int b, int c) const {
    return (Point(a) - Point(c)).dot(Point(b) - Point(c)) / Turn(a, b, c);
  }

  // Whether the angles opposite to the diagonal add up to more than 180 degrees, and the other
  // diagonal lies within both triangles.
  bool WantsFlip(const Side& first, const Side& second) const {
    const CutTriangle &t = triangles_[first.triangle], &u = triangles_[second.triangle];
    const int a = t.corners[first.k], b = t.corners[(first.k + 1) % 3],
              c = t.corners[(first.k + 2) % 3], d = u.corners[(second.k + 2) % 3];
    const double least = 1e-9 * (Point(a) - Point(b)).squaredNorm();
    if (c == d || Turn(c, a, d) <= least || Turn(d, b, c) <= least) return false;
    if (Turn(a, b, c) <= 0 || Turn(b, a, d) <= 0) return Turn(a, b, c) >= 0 && Turn(b, a, d) >= 0;
    return Cotangent(a, b, c) + Cotangent(b, a, d) < -1e-9;
  }

  // a b c and b a d become c a d and d b c.
  void Flip(int diagonal) {
    const auto [first, second] = sides_[static_cast<size_t>(diagonal)];
    const CutTriangle t = triangles_[first.triangle], u = triangles_[second.triangle];
    const size_t bc = (first.k + 1) % 3, ca = (first.k + 2) % 3, ad = (second.k + 1) % 3,
                 db = (second.k + 2) % 3;
    const int a = t.corners[first.k], b = t.corners[bc], c = t.corners[ca], d = u.corners[db];
    triangles_[first.triangle] = {{c, a, d}, {t.diagonals[ca], u.diagonals[ad], diagonal}};
    triangles_[second.triangle] = {{d, b, c}, {u.diagonals[db], t.diagonals[bc], diagonal}};
    // In the order in which no place is taken before it was left.
    const std::array<std::pair<int, std::pair<Side, Side>>, 4> moves = {{
        {t.diagonals[ca], {{first.triangle, ca}, {first.triangle, 0}}},
        {u.diagonals[ad], {{second.triangle, ad}, {first.triangle, 1}}},
        {u.diagonals[db], {{second.triangle, db}, {second.triangle, 0}}},
        {t.diagonals[bc], {{first.triangle, bc}, {second.triangle, 1}}},
    }};
    for (const auto& [moved, places] : moves) {
      Replace(moved, places.first, places.second);
      if (moved >= 0) open_.push_back(moved);
    }
    sides_[static_cast<size_t>(diagonal)] = {Side{first.triangle, 2}, Side{second.triangle, 2}};
  }

  void FlipOpen() {
    size_t left = 40 * triangles_.size();  // rounding may go round in circles
    while (!open_.empty() && left > 0) {
      const int diagonal = open_.back();
      open_.pop_back();
      const auto& [first, second] = sides_[static_cast<size_t>(diagonal)];
      if (first.triangle == second.triangle || !WantsFlip(first, second)) continue;
      Flip(diagonal);
      --left;
    }
    open_.clear();
  }

  // The edges of the loops, and by point the mean length of those at it.
  void FindLoops(double extent) {
    sizes_.assign(points_.size(), 0);
    std::vector<int> edges(points_.size(), 0);
    for (const CutTriangle& triangle : triangles_) {
      for (size_t k = 0; k < 3; ++k) {
        if (triangle.diagonals[k] >= 0) continue;
        const int a = triangle.corners[k], b = triangle.corners[(k + 1) % 3];
        loop_edges_.push_back({a, b});
        for (const int corner : {a, b}) {
          sizes_[static_cast<size_t>(corner)] += (Point(a) - Point(b)).norm();
          ++edges[static_cast<size_t>(corner)];
        }
      }
    }
    for (size_t i = 0; i < sizes_.size(); ++i) {
      sizes_[i] = std::max(sizes_[i] / std::max(edges[i], 1), kLeastSize * extent);
    }
  }

  double DistanceToEdge(const Eigen::Vector2d& place, int a, int b) const {
    const Eigen::Vector2d along = Point(b) - Point(a), to = place - Point(a);
    const double part = std::clamp(to.dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (to - part * along).norm();
  }

  void AddCell(const Eigen::Vector2d& center, double side) {
    double size = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < sizes_.size(); ++i) {
      size = std::min(size, sizes_[i] + kGrowth * (points_[i] - center).norm());
    }
    if (side > size) {
      for (const double x : {-side / 4, side / 4}) {
        for (const double y : {-side / 4, side / 4}) {
          AddCell(center + Eigen::Vector2d(x, y), side / 2);
        }
      }
      return;
    }
    for (const auto& [a, b] : loop_edges_) {
      if (!(DistanceToEdge(center, a, b) > kClearance * side)) return;
    }
    for (size_t t = 0; t < triangles_.size(); ++t) {
      const auto& [a, b, c] = triangles_[t].corners;
      const auto left_of = [&](int p, int q) {
        const Eigen::Vector2d u = Point(q) - Point(p), v = center - Point(p);
        return u.x() * v.y() - u.y() * v.x() > 0;
      };
      if (!left_of(a, b) || !left_of(b, c) || !left_of(c, a)) continue;
      Divide(t, center);
      FlipOpen();
      return;
    }
  }

  void Divide(size_t t, const Eigen::Vector2d& place) {
    const CutTriangle whole = triangles_[t];
    const auto& [a, b, c] = whole.corners;
    const auto middle = static_cast<int>(points_.size());
    points_.push_back(place);
    const auto first = static_cast<int>(sides_.size());  // diagonals from a, b, c to the middle
    const size_t second = triangles_.size(), third = second + 1;
    triangles_[t] = {{a, b, middle}, {whole.diagonals[0], first + 1, first}};
    triangles_.push_back({{b, c, middle}, {whole.diagonals[1], first + 2, first + 1}});
    triangles_.push_back({{c, a, middle}, {whole.diagonals[2], first, first + 2}});
    Replace(whole.diagonals[1], {t, 1}, {second, 0});
    Replace(whole.diagonals[2], {t, 2}, {third, 0});
    sides_.push_back({Side{t, 2}, Side{third, 1}});
    sides_.push_back({Side{t, 1}, Side{second, 2}});
    sides_.push_back({Side{second, 1}, Side{third, 2}});
    for (const int diagonal : whole.diagonals) {
      if (diagonal >= 0) open_.push_back(diagonal);
    }
  }

  // Of the extent of the face: loops are followed no finer. Of the distance: how fast cells grow.
  // Of the side of a cell: how far from the loops its centre must lie.
  static constexpr double kLeastSize = 1.0 / 64, kGrowth = 0.5, kClearance = 0.4;

  std::vector<CutTriangle>& triangles_;
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> sizes_;  // by point of a loop
  std::vector<std::array<int, 2>> loop_edges_;
  std::vector<std::array<Side, 2>> sides_;  // by diagonal
  std::vector<uint8_t> counts_;
  std::vector<int> open_;  // diagonals to look at
};

}  // namespace

std::vector<Eigen::Vector2d> RefineCut(const Eigen::Matrix2Xd& points, bool add_points,
                                       std::vector<CutTriangle>* triangles) {
  CutRefiner refiner(points, triangles);
  refiner.FlipAll();
  if (!add_points) return {};
  return refiner.AddPoints();
}

}  // namespace rilievo
