#include "core/points/point_index.h"

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/points/morton_order.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

// The `capacity` best of what the trees offer within a squared distance of `most`, by (distance,
// index): ties do not depend on how the tree was cut.
class NearestSet final : public flann::ResultSet<double> {
 public:
  NearestSet(int capacity, double most) : capacity_(static_cast<size_t>(capacity)), worst_(most) {
    heap_.reserve(capacity_);
  }

  bool full() const override { return heap_.size() == capacity_; }
  // A hair above the worst, so that equally far points still reach addPoint().
  double worstDist() const override { return worst_ * (1 + 1e-15); }
  // The next tree counts its points from here.
  void StartTree(int first_point) { first_point_ = first_point; }

  void addPoint(double distance, size_t index) override {
    const Candidate candidate{distance, first_point_ + static_cast<int>(index)};
    if (full()) {
      if (!(candidate < heap_.front())) return;
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.back() = candidate;
    } else {
      heap_.push_back(candidate);
    }
    std::push_heap(heap_.begin(), heap_.end());
    if (full()) worst_ = heap_.front().distance;
  }

  // Ascending; returns how many there are.
  int Take(int* indices, double* distances) {
    std::sort_heap(heap_.begin(), heap_.end());
    for (size_t i = 0; i < heap_.size(); ++i) {
      indices[i] = heap_[i].index;
      distances[i] = heap_[i].distance;
    }
    return static_cast<int>(heap_.size());
  }

 private:
  struct Candidate {
    double distance;
    int index;
    bool operator<(const Candidate& other) const {
      return distance < other.distance || (distance == other.distance && index < other.index);
    }
  };

  size_t capacity_;
  int first_point_ = 0;
  double worst_;                 // of the best, once there are enough
  std::vector<Candidate> heap_;  // the worst first
};

// All points within a radius. More than `most` end the search.
class BallSet final : public flann::ResultSet<double> {
 public:
  BallSet(double radius, size_t most, std::vector<int>* points)
      : limit_(radius * radius), most_(most), points_(*points) {}

  bool full() const override { return true; }
  double worstDist() const override { return is_too_many() ? -1 : limit_; }
  void addPoint(double, size_t index) override {
    points_.push_back(first_point_ + static_cast<int>(index));
  }

  void StartTree(int first_point) { first_point_ = first_point; }
  bool is_too_many() const { return points_.size() > most_; }

 private:
  double limit_;
  size_t most_;
  int first_point_ = 0;
  std::vector<int>& points_;
};

}  // namespace

struct PointIndex::Impl {
  // A tree over a stretch of points.
  class LeafTree final : public flann::KDTreeSingleIndex<flann::L2_Simple<double>> {
    using Base = flann::NNIndex<flann::L2_Simple<double>>;

   public:
    // `copy`: the tree keeps its points, in the order of its leaves, and reads `stretch` not later.
    LeafTree(const double* stretch, int64_t size, bool copy)
        : KDTreeSingleIndex(
              flann::Matrix<double>(const_cast<double*>(stretch), static_cast<size_t>(size), 3),
              flann::KDTreeSingleIndexParams(kPointIndex.leaf_size, copy)) {
      buildIndex();
      if (copy) std::vector<double*>().swap(this->Base::points_);  // where each point was
    }
  };

  // Trees over stretches of equal length: points along a Morton curve keep them apart, but any
  // order is answered exactly.
  absl::Status Build(const Eigen::Matrix3Xd& points, bool copy, const RunContext& context) {
    const int64_t count =
        (points.cols() + kPointIndex.most_tree_points - 1) / kPointIndex.most_tree_points;
    size = static_cast<int>(points.cols());
    trees.resize(static_cast<size_t>(count));
    boxes.resize(trees.size());
    first_points.resize(trees.size());
    first_codes.resize(trees.size());
    const auto build = [&](int64_t begin, int64_t end) {
      for (int64_t t = begin; t < end; ++t) {
        const int64_t first = points.cols() * t / count;
        const int64_t length = points.cols() * (t + 1) / count - first;
        const auto stretch = points.middleCols(first, length);
        trees[t] = std::make_unique<LeafTree>(stretch.data(), length, copy);
        boxes[t] = {stretch.rowwise().minCoeff(), stretch.rowwise().maxCoeff()};
        first_points[t] = static_cast<int>(first);
        first_codes[t] = CodeOf(points.col(first));
      }
    };
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, 1, context, build));
    sorted = std::is_sorted(first_codes.begin(), first_codes.end());
    return absl::OkStatus();
  }

  uint64_t CodeOf(const Eigen::Vector3d& position) const {
    const Eigen::Vector3d at = curve.ScanFromUnit(position);
    return MortonCode(MortonCell(at.x()), MortonCell(at.y()), MortonCell(at.z()));
  }

  int Query(const Eigen::Vector3d& position, int k, int* indices, double* distances,
            double most_squared = std::numeric_limits<double>::max()) const {
    NearestSet nearest(k, most_squared);
    // First the tree whose stretch of the Morton curve the position lies in: it leaves the others
    // little to offer. One that lies far off would be searched in vain, and widely.
    size_t home = 0;
    if (trees.size() > 1 && sorted) {
      const auto next =
          std::upper_bound(first_codes.begin() + 1, first_codes.end(), CodeOf(position));
      home = static_cast<size_t>(next - first_codes.begin()) - 1;
    }
    Ask(home, position, &nearest);
    for (size_t t = 0; t < trees.size(); ++t) {
      if (t == home) continue;
      if (boxes[t].squaredExteriorDistance(position) > nearest.worstDist()) continue;
      Ask(t, position, &nearest);
    }
    return nearest.Take(indices, distances);
  }

  template <typename Set>
  void Ask(size_t tree, const Eigen::Vector3d& position, Set* set) const {
    set->StartTree(first_points[tree]);
    trees[tree]->findNeighbors(*set, position.data(), exact);
  }

  int size = 0;
  std::vector<std::unique_ptr<LeafTree>> trees;
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<int> first_points;
  std::vector<uint64_t> first_codes;  // on the Morton curve
  SpatialFrame curve;
  bool sorted = true;  // the codes ascend
  flann::SearchParams exact{flann::FLANN_CHECKS_UNLIMITED, 0.0f};
};

PointIndex::PointIndex(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PointIndex::PointIndex(const Eigen::Matrix3Xd& points) : impl_(std::make_unique<Impl>()) {
  impl_->Build(points, true, RunContext{}).IgnoreError();  // nobody can stop it
}
PointIndex::~PointIndex() = default;
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;

absl::StatusOr<PointIndex> PointIndex::Build(const Eigen::Matrix3Xd& points,
                                             const RunContext& context, const SpatialFrame& curve) {
  auto impl = std::make_unique<Impl>();
  impl->curve = curve;
  RILIEVO_RETURN_IF_ERROR(impl->Build(points, true, context));
  return PointIndex(std::move(impl));
}

absl::StatusOr<PointIndex> PointIndex::BuildOver(const Eigen::Matrix3Xd& points,
                                                 const RunContext& context,
                                                 const SpatialFrame& curve) {
  auto impl = std::make_unique<Impl>();
  impl->curve = curve;
  RILIEVO_RETURN_IF_ERROR(impl->Build(points, false, context));
  return PointIndex(std::move(impl));
}

int PointIndex::size() const { return impl_->size; }

int PointIndex::Nearest(const Eigen::Vector3d& position, int k, int* indices,
                        double* squared_distances, double most_squared) const {
  return impl_->Query(position, std::min(k, size()), indices, squared_distances, most_squared);
}

bool PointIndex::Within(const Eigen::Vector3d& position, double radius, int most,
                        std::vector<int>* points) const {
  points->clear();
  BallSet ball(radius, static_cast<size_t>(most), points);
  for (size_t t = 0; t < impl_->trees.size(); ++t) {
    if (impl_->boxes[t].squaredExteriorDistance(position) > ball.worstDist()) continue;
    impl_->Ask(t, position, &ball);
  }
  return !ball.is_too_many();
}

absl::StatusOr<std::vector<int>> PointIndex::NearestOfEach(const Eigen::Matrix3Xd& positions,
                                                           const RunContext& context) const {
  std::vector<int> nearest(static_cast<size_t>(positions.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(positions.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        double distance = 0;
        for (int64_t i = begin; i < end; ++i) {
          impl_->Query(positions.col(i), 1, &nearest[i], &distance);
        }
      }));
  return nearest;
}

}  // namespace rilievo
