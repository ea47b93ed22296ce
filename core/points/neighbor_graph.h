// The k-nearest-neighbour graph, built once.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/point_index.h"
#include "core/points/settings.h"

namespace rilievo {

// A point and one of the sheet that faces its own across a wall or a gap.
struct FacingPair {
  int point, across;
};

// The neighbours of a point, ascending by distance: those of a graph, or unpacked from it.
class NeighborList {
 public:
  explicit NeighborList(std::span<const int> of_graph)
      : data_(of_graph.data()), size_(of_graph.size()) {}
  // `point` plus each of the differences.
  NeighborList(int point, const int16_t* differences, int k) : size_(static_cast<size_t>(k)) {
    for (int j = 0; j < k; ++j) unpacked_[j] = point + differences[j];
  }
  size_t size() const { return size_; }
  const int* begin() const { return data_ != nullptr ? data_ : unpacked_; }
  const int* end() const { return begin() + size_; }
  int operator[](size_t rank) const { return begin()[rank]; }
  // Not beyond this list's life.
  operator std::span<const int>() const { return {begin(), size_}; }

 private:
  const int* data_ = nullptr;
  size_t size_;
  int unpacked_[kNeighborGraph.most_neighbors];
};

struct NeighborGraph {
  int k = 0;                 // neighbours a point, the point itself not among them
  std::vector<int> indices;  // point i: [i * k, (i + 1) * k), ascending by distance
  // Once packed, in place of `indices`: differences from the point itself, which are small along a
  // Morton curve. The list of a point with a larger one begins with kFar; the next two entries are
  // the bytes of its number in `far_lists`, which holds k a list.
  std::vector<int16_t> differences;
  std::vector<int> far_lists;
  // Ascending. None but from SeparateSheets: lists of these points hold the nearest of their sheet.
  std::vector<FacingPair> facing;

  // The same lists, along a Morton curve in half the memory. Read them through neighbors() from
  // then on. CANCELLED when stopped, the lists then as they were.
  absl::Status Pack(const RunContext& context);

  int size() const {
    return k == 0 ? 0 : static_cast<int>(std::max(indices.size(), differences.size()) / k);
  }
  NeighborList neighbors(int point) const {
    const size_t begin = static_cast<size_t>(point) * k;
    if (differences.empty()) return NeighborList({indices.data() + begin, static_cast<size_t>(k)});
    const int16_t* const packed = differences.data() + begin;
    if (packed[0] != kFar) return NeighborList(point, packed, k);
    uint32_t list;
    std::memcpy(&list, packed + 1, sizeof(list));
    return NeighborList({far_lists.data() + size_t{list} * k, static_cast<size_t>(k)});
  }
  // The point of the sheet that faces its own; -1 where none is known.
  int across(int point) const;

  static constexpr int16_t kFar = std::numeric_limits<int16_t>::min();
};

// Distances of the listed neighbours, in the order of the list and in the frame of `points`.
std::vector<float> NeighborDistances(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                     int point);

// The `k` (<= kNeighborGraph.most_neighbors, < points) nearest other points of one, ascending by
// distance, into neighbors[0..k). `index`: of `points`.
void ListNeighbors(const PointIndex& index, const Eigen::Matrix3Xd& points, int point, int k,
                   int* neighbors);

struct NeighborOptions {
  int k = 16;  // [6, kNeighborGraph.most_neighbors]; lowered to size - 1 for small sets
  absl::Status Validate() const;
};

absl::StatusOr<NeighborGraph> BuildNeighborGraph(const PointIndex& index,
                                                 const Eigen::Matrix3Xd& points,
                                                 const NeighborOptions& options,
                                                 const RunContext& context);

}  // namespace rilievo
