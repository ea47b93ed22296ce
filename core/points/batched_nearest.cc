#include "core/points/batched_nearest.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/base/wide_registers.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

constexpr int kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Stretch = double
    __attribute__((vector_size(kLanes * sizeof(double)), aligned(alignof(double)), may_alias));
using Counts = int64_t __attribute__((vector_size(kLanes * sizeof(int64_t))));
using CountStretch = int64_t
    __attribute__((vector_size(kLanes * sizeof(int64_t)), aligned(alignof(int64_t)), may_alias));

size_t WholeLanes(size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

// As the index forms them, bit for bit.
RILIEVO_WIDE void SquaredDistances(const double* x, const double* y, const double* z, size_t count,
                                   const double* place, double* squared) {
  const double at_x = place[0], at_y = place[1], at_z = place[2];
  for (size_t i = 0; i < count; i += kLanes) {
    const Lanes along_x = at_x - *reinterpret_cast<const Stretch*>(x + i);
    const Lanes along_y = at_y - *reinterpret_cast<const Stretch*>(y + i);
    const Lanes along_z = at_z - *reinterpret_cast<const Stretch*>(z + i);
    *reinterpret_cast<Stretch*>(squared + i) =
        along_x * along_x + along_y * along_y + along_z * along_z;
  }
}

// How many of `values` are smaller than each; both arrays go on to whole lanes.
RILIEVO_WIDE void CountSmaller(const double* values, size_t count, int64_t* ranks) {
  for (size_t i = 0; i < count; i += kLanes) {
    const Lanes value = *reinterpret_cast<const Stretch*>(values + i);
    Counts smaller = {};
    for (size_t j = 0; j < count; ++j) smaller -= values[j] < value;
    *reinterpret_cast<CountStretch*>(ranks + i) = smaller;
  }
}

}  // namespace

BatchedNearest::BatchedNearest(const PointIndex& index, const Eigen::Matrix3Xd& points, int k)
    : index_(index),
      points_(points),
      k_(k),
      indices_(static_cast<size_t>(k)),
      squared_(static_cast<size_t>(k)) {}

int64_t BatchedNearest::Gather(const Eigen::Matrix3Xd& places, int64_t begin, int64_t end) {
  radius_ = -1;
  Eigen::AlignedBox3d box(Eigen::Vector3d(places.col(begin)));
  int64_t run_end = begin + 1;
  for (; run_end < std::min(end, begin + kBatchedNearest.most_places); ++run_end) {
    Eigen::AlignedBox3d larger = box;
    larger.extend(Eigen::Vector3d(places.col(run_end)));
    if (!(larger.diagonal().norm() < 2 * kBatchedNearest.run_radius * reach_)) break;
    box = larger;
  }
  if (run_end - begin < kBatchedNearest.fewest_places) return run_end;
  middle_ = box.center();
  const double radius = box.diagonal().norm() / 2 + kBatchedNearest.margin * reach_;
  if (!index_.Within(middle_, radius, kBatchedNearest.most_gathered, &gathered_)) return begin + 1;
  radius_ = radius * (1 - kCommon.rounding);
  const size_t whole = WholeLanes(gathered_.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& along = coordinates_[axis];
    along.assign(whole, std::numeric_limits<double>::infinity());
    for (size_t i = 0; i < gathered_.size(); ++i) along[i] = points_(axis, gathered_[i]);
  }
  distances_.resize(whole);
  listed_.resize(whole);
  listed_distances_.resize(whole + kLanes);
  ranks_.resize(whole + kLanes);
  return run_end;
}

void BatchedNearest::Find(const Eigen::Vector3d& place) {
  if (!FindGathered(place)) index_.Nearest(place, k_, indices_.data(), squared_.data());
  reach_ = std::sqrt(squared_.back());
}

bool BatchedNearest::FindGathered(const Eigen::Vector3d& place) {
  if (radius_ < 0 || static_cast<int>(gathered_.size()) < k_) return false;
  const double least_left_out = radius_ - (place - middle_).norm();
  if (!(least_left_out > 0)) return false;
  const double most = least_left_out * least_left_out;
  SquaredDistances(coordinates_[0].data(), coordinates_[1].data(), coordinates_[2].data(),
                   distances_.size(), place.data(), distances_.data());
  double bound = kBatchedNearest.margin * reach_ * reach_;
  if (!(bound > 0)) bound = most;  // the place before was that of all its points
  int count = Shortlist(std::min(bound, most));
  while (count < k_) {
    if (bound >= most) return false;
    bound *= 2;
    count = Shortlist(std::min(bound, most));
  }
  SortShortlist(count);
  return true;
}

int BatchedNearest::Shortlist(double most_squared) {
  size_t count = 0;
  for (size_t i = 0; i < gathered_.size(); ++i) {
    listed_[count] = gathered_[i];
    listed_distances_[count] = distances_[i];
    count += distances_[i] <= most_squared ? 1 : 0;
  }
  return static_cast<int>(count);
}

// Takes the nearest from the shortlist.
void BatchedNearest::SortShortlist(int count) {
  if (count <= kBatchedNearest.most_counted) {
    std::fill_n(listed_distances_.begin() + count, kLanes, std::numeric_limits<double>::infinity());
    CountSmaller(listed_distances_.data(), static_cast<size_t>(count), ranks_.data());
    for (int i = 0; i < count; ++i) {
      if (ranks_[i] >= k_) continue;
      indices_[ranks_[i]] = listed_[i];
      squared_[ranks_[i]] = listed_distances_[i];
    }
    const bool no_equals = std::accumulate(ranks_.begin(), ranks_.begin() + count, int64_t{0}) ==
                           int64_t{count} * (count - 1) / 2;
    if (no_equals) return;
  }
  std::vector<std::pair<double, int>> keyed;
  for (int i = 0; i < count; ++i) keyed.emplace_back(listed_distances_[i], listed_[i]);
  std::partial_sort(keyed.begin(), keyed.begin() + k_, keyed.end());
  for (int i = 0; i < k_; ++i) std::tie(squared_[i], indices_[i]) = keyed[i];
}

}  // namespace rilievo
