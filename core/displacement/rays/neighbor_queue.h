// The queue of cloud points by distance to a normal ray (Jeong and Kim 2002, section 4.3), pulled
// through the neighbour graph instead of a spatial search.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/key_heap.h"
#include "core/displacement/rays/ray_cloud.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// A point in the frame of the ray: (u, v) across it, `height` along it.
struct QueuedPoint {
  int point;
  float u, v, height;
  float key;  // squared distance to the ray, with the share of the height; see QueueGate
};

// What lets a point into the queue.
struct QueueGate {
  float max_height = 0;            // |height| at most
  float min_normal_agreement = 0;  // point normal . ray more than
  float reference_height = 0;      // where the surface is expected
  float height_window = 0;         // |height - reference| at most window_slope * lateral + this
  float window_slope = 0;
  // key = u^2 + v^2 + height_weight * (height - reference)^2: keeps to the nearer of two sheets.
  float height_weight = 0;
  // A point opened covers this many of its nearest neighbours, which then need no opening: their
  // neighbours are mostly its own. About three look-ups a queued point instead of the graph's k,
  // but where half of the neighbours belong to another sheet some points are missed. 0: none.
  int covered_ranks = 0;
};

// One ray at a time; holds its own scratch, so one object serves many rays and one thread.
class NeighborQueue {
 public:
  NeighborQueue(const RayCloud& cloud, const NeighborGraph& graph);

  // Descends through the graph from `start` to a point whose key is smallest among its neighbours.
  // Where that point lies well off the reference height, the reference moves to it and the walk
  // goes on: on a slanted surface far from the reference the key is smallest beside the ray.
  int Walk(const Ray& ray, int start, QueueGate* gate) const;

  // Begins a queue at a point, which is pulled with its neighbours whatever its normal.
  void Start(const Ray& ray, const QueueGate& gate, int start);

  // Pulls more points, nearest first, until `wanted` are queued; false when none are left within
  // `max_radius` of the ray.
  bool Grow(int wanted, float max_radius);

  // The queue in ascending order of key. Invalidated by Grow and Start.
  std::span<const QueuedPoint> Sorted();

  // The queue in the order in which it was pulled.
  std::span<const QueuedPoint> queued() const { return queue_; }

  const RayCloud& cloud() const { return cloud_; }

 private:
  // Points seen by the current ray: a small open hash, quicker than an array over all points.
  struct Mark {
    int point = -1;
    uint32_t ray = 0;  // twice the number of the ray that saw it, plus 1 where it is covered
  };
  static constexpr int kMarks = 4096;
  static constexpr int kMostMarked = 2048;

  int Descend(const Ray& ray, const QueueGate& gate, int start) const;
  Mark& Find(int point);
  bool IsSeen(const Mark& mark) const { return mark.ray >> 1 == ray_number_; }
  static bool IsCovered(const Mark& mark) { return (mark.ray & 1) != 0; }
  void Pull(int point, bool covered, Mark& mark);
  void Open(int point);

  const RayCloud& cloud_;
  const NeighborGraph& graph_;
  Ray ray_;
  QueueGate gate_;
  std::vector<QueuedPoint> queue_;
  KeyHeap hubs_;  // those to be opened, by their keys
  std::vector<Mark> marks_;
  uint32_t ray_number_ = 0;
  int marked_ = 0;
};

}  // namespace rilievo
