#include "core/displacement/rays/neighbor_queue.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

constexpr int kMostWalkSteps = 256;
constexpr int kMostWalkRounds = 8;
// Off the reference height by more than this many spacings, the walk takes a new reference.
constexpr float kFarSpacings = 2.0f;
// Added to the key of points that face away while walking, in squared local spacings.
constexpr float kFacingAwayPenalty = 16.0f;

struct Projected {
  float u, v, height, agreement;
};

inline Projected Project(const Ray& ray, const RayPoint& point) {
  const float x = point.position[0] - ray.origin[0];
  const float y = point.position[1] - ray.origin[1];
  const float z = point.position[2] - ray.origin[2];
  return {x * ray.u[0] + y * ray.u[1] + z * ray.u[2], x * ray.v[0] + y * ray.v[1] + z * ray.v[2],
          x * ray.direction[0] + y * ray.direction[1] + z * ray.direction[2],
          point.normal[0] * ray.direction[0] + point.normal[1] * ray.direction[1] +
              point.normal[2] * ray.direction[2]};
}

inline float Key(const Projected& at, const QueueGate& gate) {
  const float off = at.height - gate.reference_height;
  return at.u * at.u + at.v * at.v + gate.height_weight * off * off;
}

}  // namespace

NeighborQueue::NeighborQueue(const RayCloud& cloud, const NeighborGraph& graph)
    : cloud_(cloud), graph_(graph), marks_(kMarks) {
  queue_.reserve(kMostMarked);
  hubs_.Reserve(kMostMarked);
}

int NeighborQueue::Descend(const Ray& ray, const QueueGate& gate, int start) const {
  const auto key_of = [&](int index) {
    const RayPoint& point = cloud_.points[index];
    const Projected at = Project(ray, point);
    const bool facing = at.agreement > gate.min_normal_agreement;
    return Key(at, gate) + (facing ? 0.0f : kFacingAwayPenalty * point.spacing * point.spacing);
  };
  int best = start;
  float best_key = key_of(start);
  for (int step = 0; step < kMostWalkSteps; ++step) {
    const int here = best;
    for (int neighbor : graph_.neighbors(here)) {
      const float key = key_of(neighbor);
      if (key < best_key) {
        best_key = key;
        best = neighbor;
      }
    }
    if (best == here) break;
  }
  return best;
}

int NeighborQueue::Walk(const Ray& ray, int start, QueueGate* gate) const {
  for (int round = 0; round < kMostWalkRounds; ++round) {
    start = Descend(ray, *gate, start);
    const RayPoint& point = cloud_.points[start];
    const Projected at = Project(ray, point);
    const bool far = std::abs(at.height - gate->reference_height) > kFarSpacings * point.spacing;
    if (!far || !(at.agreement > gate->min_normal_agreement)) break;
    gate->reference_height = at.height;
  }
  return start;
}

NeighborQueue::Mark& NeighborQueue::Find(int point) {
  uint32_t slot = (static_cast<uint32_t>(point) * 2654435761u) >> 20;  // 32 - log2(kMarks)
  while (IsSeen(marks_[slot]) && marks_[slot].point != point) slot = (slot + 1) % kMarks;
  return marks_[slot];
}

void NeighborQueue::Pull(int index, bool covered, Mark& mark) {
  mark = {index, 2 * ray_number_ + (covered ? 1 : 0)};
  ++marked_;
  const Projected at = Project(ray_, cloud_.points[index]);
  const float lateral_squared = at.u * at.u + at.v * at.v;
  const float off = std::abs(at.height - gate_.reference_height);
  const bool takes_part =
      at.agreement > gate_.min_normal_agreement && std::abs(at.height) <= gate_.max_height &&
      off <= gate_.height_window + gate_.window_slope * std::sqrt(lateral_squared);
  if (!takes_part) return;
  const float key = Key(at, gate_);
  queue_.push_back({index, at.u, at.v, at.height, key});
  if (covered) return;
  hubs_.Push(KeyHeap::KeyOf(key, index));
}

void NeighborQueue::Open(int point) {
  const NeighborList neighbors = graph_.neighbors(point);
  for (int neighbor : neighbors) __builtin_prefetch(&cloud_.points[neighbor]);
  int rank = 0;
  for (int neighbor : neighbors) {
    const bool covers = rank++ < gate_.covered_ranks;
    Mark& mark = Find(neighbor);
    if (!IsSeen(mark)) {
      Pull(neighbor, covers, mark);
    } else if (covers) {
      mark.ray |= 1;
    }
  }
}

void NeighborQueue::Start(const Ray& ray, const QueueGate& gate, int start) {
  ray_ = ray;
  gate_ = gate;
  queue_.clear();
  hubs_.Clear();
  marked_ = 0;
  constexpr uint32_t kMostRays = 0x7fffffff;
  if (ray_number_++ == kMostRays) {  // forget what earlier rays left
    std::fill(marks_.begin(), marks_.end(), Mark());
    ray_number_ = 1;
  }
  Pull(start, true, Find(start));  // opened right here
  Open(start);
}

bool NeighborQueue::Grow(int wanted, float max_radius) {
  while (static_cast<int>(queue_.size()) < wanted) {
    if (hubs_.empty() || marked_ + graph_.k >= kMostMarked) return false;
    if (KeyHeap::ValueOf(hubs_.First()) > max_radius * max_radius) return false;
    const int point = KeyHeap::IndexOf(hubs_.Pop());
    if (!IsCovered(Find(point))) Open(point);
  }
  return true;
}

std::span<const QueuedPoint> NeighborQueue::Sorted() {
  std::sort(queue_.begin(), queue_.end(), [](const QueuedPoint& a, const QueuedPoint& b) {
    return a.key != b.key ? a.key < b.key : a.point < b.point;
  });
  return queue_;
}

}  // namespace rilievo
