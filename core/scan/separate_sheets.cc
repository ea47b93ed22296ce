#include "core/scan/separate_sheets.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 64;
// One of so many points is looked at first: a wall of any size holds more.
constexpr int kStride = 16;
// Of a neighbourhood, with the point itself.
constexpr int kAround = 64;
constexpr int kFewestOfLayer = 14;
// How clearly two layers must stand apart.
struct Gap {
  double most_within;   // what is left of the squares within the layers
  double most_between;  // share of the points in the middle third between the layers
};
// The first is 0.36 of Gaussian heights, 0.25 of uniform ones, 0.19 of those of a rod, 0.2 of
// layers four deviations apart; the second 0.21, 0.17, 0.14 and 0.09.
constexpr Gap kClear = {0.2, 0.09};
constexpr Gap kBesideClear = {0.25, 0.13};
// Share of the squares within from which a quadric with a step will not part them either.
constexpr double kHopeless = 0.33;
// From layer to layer along their plane, against the distance of points within one.
constexpr double kMostApart = 1.4;
// Thickness of a list against its width below which nothing else lies in it.
constexpr double kThin = 0.12;
// Variance across a list of one layer, against that of a list from both.
constexpr double kThinner = 0.65;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector7 = Eigen::Matrix<double, 7, 1>;

// Two layers over the same place. Lengths in the unit of the heights.
struct Layers {
  double low = 0, high = 0;  // mean height
  double within = 1;         // share of the squares
  double threshold = 0;
};

// Otsu's threshold.
Layers SplitHeights(std::span<const double> heights) {
  std::array<double, kAround> sorted;
  std::copy(heights.begin(), heights.end(), sorted.begin());
  const auto count = static_cast<int>(heights.size());
  std::sort(sorted.begin(), sorted.begin() + count);
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    sum += sorted[i];
    squares += sorted[i] * sorted[i];
  }
  const double spread = squares - sum * sum / count;
  Layers best;
  double between = 0, below = 0;
  for (int i = 1; i < count; ++i) {
    below += sorted[i - 1];
    if (i < kFewestOfLayer || i + kFewestOfLayer > count) continue;
    const double low = below / i, high = (sum - below) / (count - i);
    const double gained =
        static_cast<double>(i) * (count - i) / count * (high - low) * (high - low);
    if (gained <= between) continue;
    between = gained;
    best.low = low;
    best.high = high;
    best.threshold = (sorted[i - 1] + sorted[i]) / 2;
  }
  best.within = spread > 0 ? 1 - between / spread : 1;
  return best;
}

// The points around one, in the frame of their plane.
class Neighborhood {
 public:
  Neighborhood(const Eigen::Matrix3Xd& points, const PointIndex& index, int center) {
    std::array<double, kAround> squared;
    count_ = index.Nearest(points.col(center), std::min(kAround, index.size()), around_.data(),
                           squared.data());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int i = 0; i < count_; ++i) mean += points.col(around_[i]) / count_;
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (int i = 0; i < count_; ++i) {
      const Eigen::Vector3d offset = points.col(around_[i]) - mean;
      moments.selfadjointView<Eigen::Lower>().rankUpdate(offset);
    }
    const double radius = std::sqrt(squared[count_ - 1]);
    if (!(radius > 0)) return;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
    axes.computeDirect(moments);
    for (int i = 0; i < count_; ++i) {
      const Eigen::Vector3d local =
          axes.eigenvectors().transpose() * (points.col(around_[i]) - mean) / radius;
      const double x = local[2], y = local[1];
      rows_[i] << 1, x, y, x * x, x * y, y * y;
      heights_[i] = local[0];
    }
    usable_ = true;
  }

  // The layer of each point, low or high; empty where there are no two.
  std::span<const uint8_t> FindLayers(const Gap& gap) {
    constexpr int kRounds = 3;
    if (!usable_) return {};
    Layers layers;
    for (int round = 0; round < kRounds; ++round) {
      std::array<double, kAround> flat;
      Flatten(round > 0, flat.data());
      layers = SplitHeights({flat.data(), static_cast<size_t>(count_)});
      if (layers.within > kHopeless) return {};
      for (int i = 0; i < count_; ++i) layer_[i] = flat[i] > layers.threshold ? 1 : 0;
      if (round + 1 < kRounds) continue;
      const double middle = (layers.low + layers.high) / 2;
      const double reach = (layers.high - layers.low) / 6;
      const auto between = std::count_if(flat.begin(), flat.begin() + count_, [&](double height) {
        return std::abs(height - middle) < reach;
      });
      if (layers.within > gap.most_within ||
          static_cast<double>(between) > gap.most_between * static_cast<double>(count_)) {
        return {};
      }
    }
    if (!LayersOverlap()) return {};
    return {layer_.data(), static_cast<size_t>(count_)};
  }

  // Of the other layer, the point nearest along the plane to the i-th.
  int Across(int i) const {
    const auto distance = [&](int j) {
      return layer_[j] == layer_[i] ? std::numeric_limits<double>::max()
                                    : (rows_[i] - rows_[j]).segment<2>(1).squaredNorm();
    };
    int nearest = 0;
    for (int j = 1; j < count_; ++j) {
      if (distance(j) < distance(nearest)) nearest = j;
    }
    return around_[nearest];
  }

  int count() const { return count_; }
  int point(int i) const { return around_[i]; }

 private:
  // Whether the layers lie over the same place: along the plane, points of the smaller one have
  // points of the larger one as near as those have each other. Beside a step, an edge or a raised
  // pattern they have not.
  bool LayersOverlap() const {
    const auto high = std::count(layer_.begin(), layer_.begin() + count_, uint8_t{1});
    const uint8_t larger = 2 * high > count_ ? 1 : 0;
    return NearestAlong(1 - larger, larger) <
           kMostApart * kMostApart * NearestAlong(larger, larger);
  }

  // The middle squared distance along the plane from a point of one layer to the nearest other of
  // the same or another one.
  double NearestAlong(int from, int to) const {
    std::array<double, kAround> nearest;
    int found = 0;
    for (int i = 0; i < count_; ++i) {
      if (layer_[i] != from) continue;
      double least = std::numeric_limits<double>::max();
      for (int j = 0; j < count_; ++j) {
        if (layer_[j] != to || j == i) continue;
        least = std::min(least, (rows_[i] - rows_[j]).segment<2>(1).squaredNorm());
      }
      nearest[found++] = least;
    }
    std::nth_element(nearest.begin(), nearest.begin() + found / 2, nearest.begin() + found);
    return nearest[found / 2];
  }

  // Heights over the quadric that fits best, with a step between the layers if there are any yet.
  void Flatten(bool step, double* flat) const {
    Eigen::Matrix<double, 7, 7> gram = Eigen::Matrix<double, 7, 7>::Zero();
    Vector7 right = Vector7::Zero();
    for (int i = 0; i < count_; ++i) {
      Vector7 row;
      row << rows_[i], step ? layer_[i] - 0.5 : 0.0;
      gram.selfadjointView<Eigen::Lower>().rankUpdate(row);
      right += heights_[i] * row;
    }
    gram.diagonal().array() += 1e-9;
    const Vector7 fit = gram.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    for (int i = 0; i < count_; ++i) flat[i] = heights_[i] - fit.head<6>().dot(rows_[i]);
  }

  int count_ = 0;
  bool usable_ = false;
  std::array<int, kAround> around_;
  std::array<Vector6, kAround> rows_;
  std::array<double, kAround> heights_;
  std::array<uint8_t, kAround> layer_;
};

// Variances of a point and its neighbours along their principal axes, ascending.
Eigen::Vector3d Variances(const Eigen::Matrix3Xd& points, int center,
                          std::span<const int> neighbors) {
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Eigen::Vector3d at = points.col(center);
  for (const int j : neighbors) {
    const Eigen::Vector3d offset = points.col(j) - at;
    sum += offset;
    moments.selfadjointView<Eigen::Lower>().rankUpdate(offset);
  }
  const auto count = static_cast<double>(neighbors.size() + 1);
  moments -= sum * sum.transpose() / count;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(moments / count, Eigen::EigenvaluesOnly);
  return axes.eigenvalues();
}

// The point across, where one stands in a layer, else -1; `own` takes the nearest of its layer, as
// many as a list of the graph holds.
int LookAcross(const Eigen::Matrix3Xd& points, const PointIndex& index, const NeighborGraph& graph,
               const Gap& gap, int center, int* own) {
  const std::span<const int> nearest = graph.neighbors(center);
  const Eigen::Vector3d variances = Variances(points, center, nearest);
  if (variances[0] < kThin * kThin * variances[1]) return -1;
  Neighborhood neighborhood(points, index, center);
  const std::span<const uint8_t> layers = neighborhood.FindLayers(gap);
  int self = 0;
  while (self < static_cast<int>(layers.size()) && neighborhood.point(self) != center) ++self;
  if (self == static_cast<int>(layers.size())) return -1;
  int found = 0;
  for (int i = 0; i < neighborhood.count() && found < graph.k; ++i) {
    if (layers[i] == layers[self] && i != self) own[found++] = neighborhood.point(i);
  }
  if (found < graph.k) return -1;
  const std::span<const int> list(own, static_cast<size_t>(graph.k));
  const bool changed = !std::equal(list.begin(), list.end(), nearest.begin());
  if (changed && Variances(points, center, list)[0] > kThinner * variances[0]) return -1;
  return neighborhood.Across(self);
}

// Points in layers, with their new lists.
struct Layered {
  std::vector<FacingPair> pairs;
  std::vector<int> lists;  // k entries a pair
};

// Looks at the points named, and appends those that stand in a layer.
absl::Status LookAt(const Eigen::Matrix3Xd& points, const PointIndex& index,
                    const NeighborGraph& graph, const Gap& gap, const std::vector<int>& named,
                    const RunContext& context, Layered* layered) {
  std::vector<int> across(named.size()), lists(named.size() * static_cast<size_t>(graph.k));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(named.size()), kBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          across[i] = LookAcross(points, index, graph, gap, named[i], &lists[i * graph.k]);
        }
      }));
  for (size_t i = 0; i < named.size(); ++i) {
    if (across[i] < 0) continue;
    layered->pairs.push_back({named[i], across[i]});
    const auto list = lists.begin() + static_cast<int64_t>(i) * graph.k;
    layered->lists.insert(layered->lists.end(), list, list + graph.k);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::optional<NeighborGraph>> SeparateSheets(const Eigen::Matrix3Xd& points,
                                                            const PointIndex& index,
                                                            const NeighborGraph& graph,
                                                            const RunContext& context) {
  const int count = graph.size();
  if (count < kAround) return std::nullopt;
  std::vector<uint8_t> looked(static_cast<size_t>(count), 0);
  std::vector<int> next;
  for (int i = 0; i < count; i += kStride) next.push_back(i);
  Layered layered;
  for (Gap gap = kClear; !next.empty(); gap = kBesideClear) {
    const size_t known = layered.pairs.size();
    RILIEVO_RETURN_IF_ERROR(LookAt(points, index, graph, gap, next, context, &layered));
    next.clear();
    for (size_t i = known; i < layered.pairs.size(); ++i) looked[layered.pairs[i].point] = 1;
    for (size_t i = known; i < layered.pairs.size(); ++i) {
      for (const int j : graph.neighbors(layered.pairs[i].point)) {
        if (looked[j] == 0) next.push_back(j);
        looked[j] = 1;
      }
    }
  }
  if (layered.pairs.empty()) return std::nullopt;
  NeighborGraph separated = graph;
  for (size_t i = 0; i < layered.pairs.size(); ++i) {
    std::copy_n(layered.lists.begin() + static_cast<int64_t>(i) * graph.k, graph.k,
                separated.indices.begin() + static_cast<int64_t>(layered.pairs[i].point) * graph.k);
  }
  separated.facing = std::move(layered.pairs);
  std::sort(separated.facing.begin(), separated.facing.end(),
            [](const FacingPair& a, const FacingPair& b) { return a.point < b.point; });
  return separated;
}

}  // namespace rilievo
