#include "core/booleans/cut_loops.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace rilievo {
namespace {

// Twice the area, positive where p, q, r turn left.
double Turn(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Eigen::Vector2d& r) {
  const Eigen::Vector2d u = q - p, v = r - p;
  return u.x() * v.y() - u.y() * v.x();
}

// Ears are cut off, well shaped ones first; holes are joined to the loops around them before (D.
// Eberly, "Triangulation by Ear Clipping", 2002).
class LoopCutter {
 public:
  LoopCutter(const Eigen::Matrix2Xd& points, const std::vector<std::vector<int>>& loops)
      : points_(points) {
    std::vector<int> holes;
    for (const std::vector<int>& loop : loops) {
      const int first = AddLoop(loop);
      (AreaOf(loop) < 0 ? holes : outer_).push_back(first);
    }
    if (outer_.empty()) std::swap(outer_, holes);
    JoinHoles(std::move(holes));
  }

  std::vector<CutTriangle> Cut() {
    for (const int first : outer_) CutOne(first);
    return std::move(triangles_);
  }

 private:
  struct Node {
    int point, previous, next;
    int diagonal;  // to the next node, or -1
    int version = 0;
    bool gone = false;
  };
  struct Ear {
    double quality;
    int node, version;
    bool operator<(const Ear& other) const {
      return quality < other.quality || (quality == other.quality && node > other.node);
    }
  };

  Node& At(int node) { return nodes_[static_cast<size_t>(node)]; }
  Eigen::Vector2d Place(int node) const {
    return points_.col(nodes_[static_cast<size_t>(node)].point);
  }

  double AreaOf(const std::vector<int>& loop) const {
    double area = 0;
    for (size_t i = 1; i + 1 < loop.size(); ++i) {
      area += Turn(points_.col(loop[0]), points_.col(loop[i]), points_.col(loop[i + 1]));
    }
    return area;
  }

  int AddLoop(const std::vector<int>& loop) {
    const auto first = static_cast<int>(nodes_.size()), count = static_cast<int>(loop.size());
    for (int i = 0; i < count; ++i) {
      nodes_.push_back({loop[static_cast<size_t>(i)], first + (i + count - 1) % count,
                        first + (i + 1) % count, -1});
    }
    return first;
  }

  template <typename Visit>
  void ForEachNode(int first, const Visit& visit) {
    int node = first;
    do {
      visit(node);
      node = At(node).next;
    } while (node != first);
  }

  // The node of the ring from `first` that lies farthest along x.
  int Rightmost(int first) {
    int best = first;
    ForEachNode(first, [&](int node) {
      if (Place(node).x() > Place(best).x()) best = node;
    });
    return best;
  }

  // From the right to the left, so that what lies to the right of a hole is joined before.
  void JoinHoles(std::vector<int> holes) {
    for (int& hole : holes) hole = Rightmost(hole);
    std::sort(holes.begin(), holes.end(), [&](int a, int b) {
      const double x = Place(a).x(), y = Place(b).x();
      return x > y || (x == y && a < b);
    });
    for (const int hole : holes) Join(BridgeEnd(hole), hole);
  }

  // Whether the node's corner opens towards `place`.
  bool OpensTo(int node, const Eigen::Vector2d& place) {
    const Eigen::Vector2d at = Place(node), before = Place(At(node).previous),
                          after = Place(At(node).next);
    const bool left_of_after = Turn(at, after, place) >= 0;
    const bool left_of_before = Turn(before, at, place) >= 0;
    return Turn(before, at, after) >= 0 ? left_of_after && left_of_before
                                        : left_of_after || left_of_before;
  }

  // A node that the rightmost one of a hole sees.
  int BridgeEnd(int hole) {
    const Eigen::Vector2d from = Place(hole);
    double nearest = std::numeric_limits<double>::infinity();
    int edge = -1;
    for (const int first : outer_) {
      ForEachNode(first, [&](int node) {
        const Eigen::Vector2d a = Place(node), b = Place(At(node).next);
        if (!(a.y() <= from.y() && b.y() > from.y())) return;
        const double x = a.x() + (from.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        if (x >= from.x() && x < nearest) {
          nearest = x;
          edge = node;
        }
      });
    }
    if (edge < 0) return NearestNode(from);
    const int tip = At(edge).next;
    const int end = Place(tip).x() > Place(edge).x() ? tip : edge;
    const Eigen::Vector2d hit(nearest, from.y()), goal = Place(end);
    // Of the nodes within the triangle of `from`, `hit` and `goal` the one at the smallest angle.
    const double side = goal.y() < from.y() ? -1 : 1;
    int best = end;
    double best_slope = std::numeric_limits<double>::infinity(), best_x = 0;
    for (const int first : outer_) {
      ForEachNode(first, [&](int node) {
        const Eigen::Vector2d place = Place(node);
        if (place.x() < from.x() || !OpensTo(node, from)) return;
        if (side * Turn(from, hit, place) < 0 || side * Turn(hit, goal, place) < 0 ||
            side * Turn(goal, from, place) < 0) {
          return;
        }
        const double along = place.x() - from.x(), slope = std::abs(place.y() - from.y()) / along;
        if (slope < best_slope || (slope == best_slope && place.x() < best_x)) {
          best = node;
          best_slope = slope;
          best_x = place.x();
        }
      });
    }
    return best;
  }

  int NearestNode(const Eigen::Vector2d& from) {
    int best = outer_[0];
    for (const int first : outer_) {
      ForEachNode(first, [&](int node) {
        if ((Place(node) - from).squaredNorm() < (Place(best) - from).squaredNorm()) best = node;
      });
    }
    return best;
  }

  // Along a diagonal there and back.
  void Join(int outer, int hole) {
    const int bridge = diagonals_++;
    const auto outer_copy = static_cast<int>(nodes_.size()), hole_copy = outer_copy + 1;
    const int after_outer = At(outer).next, before_hole = At(hole).previous;
    nodes_.push_back({At(outer).point, hole_copy, after_outer, At(outer).diagonal});
    nodes_.push_back({At(hole).point, before_hole, outer_copy, bridge});
    At(after_outer).previous = outer_copy;
    At(before_hole).next = hole_copy;
    At(outer).next = hole;
    At(outer).diagonal = bridge;
    At(hole).previous = outer;
  }

  // 4 sqrt(3) times the area by the squares of the sides: 1 for an equilateral triangle. Negative
  // where the corner is no ear.
  double QualityOf(int node) {
    const int before = At(node).previous, after = At(node).next;
    const Eigen::Vector2d a = Place(before), b = Place(node), c = Place(after);
    const double turn = Turn(a, b, c);
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    const double quality = sides > 0 ? 2 * std::sqrt(3) * turn / sides : 0;
    if (quality <= 0) return quality - 1;
    for (const int other : reflex_) {
      const Node& node_of_other = At(other);
      if (node_of_other.gone || other == before || other == node || other == after) continue;
      const int point = node_of_other.point;
      if (point == At(before).point || point == At(node).point || point == At(after).point) {
        continue;
      }
      const Eigen::Vector2d place = points_.col(point);
      if (Turn(a, b, place) >= 0 && Turn(b, c, place) >= 0 && Turn(c, a, place) >= 0) {
        return quality - 3;
      }
    }
    return quality;
  }

  bool IsReflex(int node) {
    return Turn(Place(At(node).previous), Place(node), Place(At(node).next)) <= 0;
  }

  void Push(int node) { ears_.push({QualityOf(node), node, ++At(node).version}); }

  // What was no ear may have become one.
  void PushAll(int first) {
    ears_ = {};
    std::erase_if(reflex_, [&](int node) { return At(node).gone || !IsReflex(node); });
    ForEachNode(first, [&](int node) { Push(node); });
  }

  void CutOne(int first) {
    int left = 0;
    reflex_.clear();
    ForEachNode(first, [&](int node) {
      ++left;
      if (IsReflex(node)) reflex_.push_back(node);
    });
    PushAll(first);
    bool fresh = true;  // nothing has changed since PushAll()
    while (left > 3) {
      const Ear ear = ears_.top();
      ears_.pop();
      if (At(ear.node).gone || At(ear.node).version != ear.version) continue;
      if (ear.quality <= 0 && !fresh) {
        PushAll(ear.node);
        fresh = true;
        continue;
      }
      const int before = At(ear.node).previous, after = At(ear.node).next;
      const int diagonal = diagonals_++;
      triangles_.push_back({{At(before).point, At(ear.node).point, At(after).point},
                            {At(before).diagonal, At(ear.node).diagonal, diagonal}});
      At(ear.node).gone = true;
      At(before).next = after;
      At(before).diagonal = diagonal;
      At(after).previous = before;
      --left;
      fresh = false;
      first = before;
      for (const int node : {before, after}) Push(node);
    }
    const int second = At(first).next, third = At(second).next;
    triangles_.push_back({{At(first).point, At(second).point, At(third).point},
                          {At(first).diagonal, At(second).diagonal, At(third).diagonal}});
  }

  const Eigen::Matrix2Xd& points_;
  std::vector<Node> nodes_;
  std::vector<int> outer_;  // a node of each ring
  std::vector<int> reflex_;
  std::priority_queue<Ear> ears_;
  std::vector<CutTriangle> triangles_;
  int diagonals_ = 0;
};

}  // namespace

std::vector<CutTriangle> CutLoops(const Eigen::Matrix2Xd& points,
                                  const std::vector<std::vector<int>>& loops) {
  return LoopCutter(points, loops).Cut();
}

}  // namespace rilievo
