#include "core/scan/local_shape/separate_sheets.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/scratch_pool.h"
#include "core/base/status_macros.h"
#include "core/points/batched_nearest.h"
#include "core/points/curve_stretches.h"
#include "core/scan/local_shape/settings.h"
#include "core/scan/local_shape/two_sheets.h"

namespace rilievo {
namespace {

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

// A point by which a second sheet may lie.
struct Suspect {
  int64_t place;     // among those looked at
  double thickness;  // variance across its list
};

// The point across, where one stands in a sheet, else -1; `own` takes the nearest of its sheet, as
// many as a list of the graph holds. `thickness`: the variance across its list.
int LookAcross(const Eigen::Matrix3Xd& points, const NeighborGraph& graph, const SheetGap& gap,
               int center, double thickness, SheetNeighborhood* around, int* own) {
  SheetNeighborhood& neighborhood = *around;
  const std::span<const uint8_t> sheets = neighborhood.FindSheets(gap);
  int self = 0;
  while (self < static_cast<int>(sheets.size()) && neighborhood.point(self) != center) ++self;
  if (self == static_cast<int>(sheets.size())) return -1;
  int found = 0;
  for (int i = 0; i < neighborhood.count() && found < graph.k; ++i) {
    if (sheets[i] == sheets[self] && i != self) own[found++] = neighborhood.point(i);
  }
  if (found < graph.k) return -1;
  const std::span<const int> list(own, static_cast<size_t>(graph.k));
  const bool changed = !std::equal(list.begin(), list.end(), graph.neighbors(center).begin());
  if (changed && Variances(points, center, list)[0] > kSeparateSheets.thinner * thickness)
    return -1;
  return neighborhood.Across(self);
}

// Points in sheets, with their new lists.
struct Layered {
  std::vector<FacingPair> pairs;
  std::vector<int> lists;  // k entries a pair
};

// Looks at the points named, and appends those that stand in a sheet.
absl::Status LookAt(const Eigen::Matrix3Xd& points, const PointIndex& index,
                    const NeighborGraph& graph, const SheetGap& gap, const std::vector<int>& named,
                    const RunContext& context, Layered* layered) {
  std::vector<int> across(named.size(), -1), lists(named.size() * static_cast<size_t>(graph.k));
  const BatchedNearest prototype(index, points, kSheetPoints);
  ScratchPool<BatchedNearest> pool(prototype);
  const auto look = [&](int64_t begin, int64_t end) {
    std::vector<Suspect> suspects;
    Eigen::Matrix3Xd places(3, end - begin);
    for (int64_t i = begin; i < end; ++i) {
      const Eigen::Vector3d variances = Variances(points, named[i], graph.neighbors(named[i]));
      if (variances[0] < kSeparateSheets.thin * kSeparateSheets.thin * variances[1]) continue;
      places.col(static_cast<int64_t>(suspects.size())) = points.col(named[i]);
      suspects.push_back({i, variances[0]});
    }
    const auto found = [&](int64_t suspect, const int* nearest, const double* squared) {
      const auto [i, thickness] = suspects[suspect];
      SheetNeighborhood around(points, {nearest, kSheetPoints},
                               std::sqrt(squared[kSheetPoints - 1]));
      across[i] = LookAcross(points, graph, gap, named[i], thickness, &around, &lists[i * graph.k]);
    };
    pool.Take()->OfEach(places, 0, static_cast<int64_t>(suspects.size()), found);
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(named.size()), kHeavyBlock, context, look));
  for (size_t i = 0; i < named.size(); ++i) {
    if (across[i] < 0) continue;
    layered->pairs.push_back({named[i], across[i]});
    const auto list = lists.begin() + static_cast<int64_t>(i) * graph.k;
    layered->lists.insert(layered->lists.end(), list, list + graph.k);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ReplacedLists> SeparateSheets(const Eigen::Matrix3Xd& points,
                                             const PointIndex& index, const SpatialFrame& curve,
                                             const RunContext& context, NeighborGraph* graph) {
  if (IsLeftOut(Mechanism::kSeparateSheets)) return ReplacedLists();
  const int count = graph->size();
  if (count < kSheetPoints) return ReplacedLists{};
  std::vector<uint8_t> looked(static_cast<size_t>(count), 0);
  std::vector<int> next;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint64_t> codes, CodesAlong(points, curve, context));
  for (const int64_t end : StretchEnds(codes, kSeparateSheets.fewest_per_look)) {
    next.push_back(static_cast<int>(end - 1));
  }
  Layered layered;
  const SeparateSheetsSettings& of = kSeparateSheets;
  const SheetGap clear = {of.clear_within, of.clear_between};
  const SheetGap beside = {of.beside_clear_within, of.beside_clear_between};
  for (SheetGap gap = clear; !next.empty(); gap = beside) {
    const size_t known = layered.pairs.size();
    RILIEVO_RETURN_IF_ERROR(LookAt(points, index, *graph, gap, next, context, &layered));
    next.clear();
    for (size_t i = known; i < layered.pairs.size(); ++i) looked[layered.pairs[i].point] = 1;
    for (size_t i = known; i < layered.pairs.size(); ++i) {
      for (const int j : graph->neighbors(layered.pairs[i].point)) {
        if (looked[j] == 0) next.push_back(j);
        looked[j] = 1;
      }
    }
  }
  ReplacedLists replaced;
  replaced.points.reserve(layered.pairs.size());
  for (const FacingPair& pair : layered.pairs) replaced.points.push_back(pair.point);
  replaced.lists = std::move(layered.lists);
  for (size_t i = 0; i < replaced.points.size(); ++i) {
    const auto list = replaced.lists.begin() + static_cast<int64_t>(i) * graph->k;
    std::swap_ranges(list, list + graph->k,
                     graph->indices.begin() + static_cast<int64_t>(replaced.points[i]) * graph->k);
  }
  graph->facing = std::move(layered.pairs);
  std::sort(graph->facing.begin(), graph->facing.end(),
            [](const FacingPair& a, const FacingPair& b) { return a.point < b.point; });
  return replaced;
}

void JoinSheets(const ReplacedLists& replaced, NeighborGraph* graph) {
  for (size_t i = 0; i < replaced.points.size(); ++i) {
    std::copy_n(replaced.lists.begin() + static_cast<int64_t>(i) * graph->k, graph->k,
                graph->indices.begin() + static_cast<int64_t>(replaced.points[i]) * graph->k);
  }
  graph->facing.clear();
}

}  // namespace rilievo
