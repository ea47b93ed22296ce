#include <algorithm>
#include <cmath>
#include <limits>

#include "core/surface/closest_point_tree.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {

using Eigen::Vector3d;

double ClosestPointTree::SquaredDistanceToItem(const Vector3d& local, int item) const {
  if (points_) return (local - CornerOf(item, 0)).squaredNorm();
  return SquaredDistanceToTriangle(local, CornerOf(item, 0), CornerOf(item, 1), CornerOf(item, 2));
}

namespace {

constexpr float kNotReached = std::numeric_limits<float>::infinity();
// Deep enough for 2^31 items: 16 levels, three siblings left on the stack at each.
constexpr int kStack = 64;

// What a search keeps: the item nearest so far, whether there is one, or the few nearest.
class NearestOne {
 public:
  explicit NearestOne(ClosestPointTree::Hit first) : hit_(first) {}
  double radius_squared() const { return hit_.squared_distance; }
  bool Take(double squared, int item) {
    if (squared >= hit_.squared_distance) return false;
    hit_ = {squared, item};
    return true;
  }
  ClosestPointTree::Hit hit() const { return hit_; }

 private:
  ClosestPointTree::Hit hit_;
};

// Whether any is near enough: once one is, next to no others are looked for.
class AnyWithin {
 public:
  explicit AnyWithin(double most) : most_(most) {}
  double radius_squared() const { return found_ ? 0 : most_; }
  bool Take(double squared, int) {
    if (found_ || !(squared <= most_)) return false;
    return found_ = true;
  }
  bool found() const { return found_; }

 private:
  double most_;
  bool found_ = false;
};

class NearestSome {
 public:
  // `most`: squared distance below which there are enough.
  NearestSome(std::span<ClosestPointTree::Hit> hits, double most) : hits_(hits), most_(most) {}
  double radius_squared() const {
    return count_ < hits_.size() ? most_ : hits_[count_ - 1].squared_distance;
  }
  bool Take(double squared, int item) {
    if (squared >= radius_squared()) return false;
    if (count_ < hits_.size()) ++count_;
    size_t place = count_ - 1;
    for (; place > 0 && hits_[place - 1].squared_distance > squared; --place) {
      hits_[place] = hits_[place - 1];
    }
    hits_[place] = {squared, item};
    return true;
  }
  size_t count() const { return count_; }

 private:
  std::span<ClosestPointTree::Hit> hits_;
  double most_;
  size_t count_ = 0;
};

}  // namespace

ClosestPointTree::Hit ClosestPointTree::Closest(const Vector3d& point, int hint) const {
  const Vector3d local = point - origin_;
  // Any first item will do; it also answers for points so far out that float distances overflow.
  if (hint < 0 || hint >= item_count()) hint = 0;
  NearestOne best({SquaredDistanceToItem(local, hint), hint});
  Search(local, &best);
  return best.hit();
}

bool ClosestPointTree::HasWithin(const Vector3d& point, double distance) const {
  AnyWithin any(distance * distance);
  Search(point - origin_, &any);
  return any.found();
}

int ClosestPointTree::Nearest(const Vector3d& point, std::span<Hit> hits, bool hinted) const {
  if (hits.empty()) return 0;
  const Vector3d local = point - origin_;
  double most = kNotReached;
  if (hinted) {
    constexpr double kHairMore = 1 + 1e-12;  // so that the farthest itself may be taken
    most = std::numeric_limits<double>::min();
    for (const Hit& hit : hits) {
      most = std::max(most, kHairMore * SquaredDistanceToItem(local, hit.item));
    }
  }
  NearestSome best(hits, most);
  Search(local, &best);
  return static_cast<int>(best.count());
}

template <typename Best>
void ClosestPointTree::Search(const Vector3d& local, Best* best) const {
  const float p[3] = {static_cast<float>(local[0] * box_scale_),
                      static_cast<float>(local[1] * box_scale_),
                      static_cast<float>(local[2] * box_scale_)};
  // Rounding of p (half a unit in the last place an axis) and of the float arithmetic below: boxes
  // are dropped only beyond a radius enlarged by both.
  const double point_error = 1.1e-7 * (std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2])) + 1e-30;
  const auto radius_of = [&](double squared_distance) {
    const double radius = (std::sqrt(squared_distance) * box_scale_ + point_error) * (1 + 1e-6);
    return static_cast<float>(radius * radius);
  };
  float radius = radius_of(best->radius_squared());
  struct Entry {
    float distance;
    int32_t node;
  };
  Entry stack[kStack];
  int top = 0;
  stack[top++] = {0, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.distance > radius) continue;
    const Node& node = nodes_[entry.node];
    const FourBoxes::Lanes distance = node.boxes.SquaredDistances(p);
    // Farthest first, so that the nearest child is the next one popped.
    Entry near[kWidth];
    int near_count = 0;
    for (int k = 0; k < kWidth; ++k) {
      if (!(distance[k] <= radius) || distance[k] == kNotReached) continue;
      int place = near_count++;
      for (; place > 0 && near[place - 1].distance < distance[k]; --place) {
        near[place] = near[place - 1];
      }
      near[place] = {distance[k], node.child[k]};
    }
    for (int i = near_count - 1; i >= 0; --i) {
      if (near[i].node >= 0 || near[i].distance > radius) continue;
      const Run run = RunOf(near[i].node);
      bool taken = false;
      for (int item = run.first; item < run.first + run.count; ++item) {
        taken |= best->Take(SquaredDistanceToItem(local, item), item);
      }
      if (taken) radius = radius_of(best->radius_squared());
    }
    for (int i = 0; i < near_count; ++i) {
      if (near[i].node >= 0 && near[i].distance <= radius) stack[top++] = near[i];
    }
  }
}

}  // namespace rilievo
