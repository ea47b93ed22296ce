#include "core/scan/clean/find_foliage.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/clean/settings.h"
#include "core/scan/local_shape/patch_moments.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// How far a point is from its neighbours, along the normals halfway between theirs and its own, so
// that curvature counts for nothing.
float OffNeighbors(const OrientedCloud& cloud, const NeighborGraph& graph, int point) {
  float distances[kNeighborGraph.most_neighbors];
  int count = 0;
  const Eigen::Vector3d own = cloud.normals.col(point);
  for (const int j : graph.neighbors(point)) {
    const Eigen::Vector3d other = cloud.normals.col(j);
    const Eigen::Vector3d halfway = other + (own.dot(other) < 0 ? -1.0 : 1.0) * own;
    const double distance = halfway.normalized().dot(cloud.points.col(point) - cloud.points.col(j));
    distances[count++] = static_cast<float>(std::abs(distance));
  }
  float* const chosen = distances + static_cast<int>(kFindFoliage.own_sheet * count);
  std::nth_element(distances, chosen, distances + count);
  return *chosen;
}

// Per point, 1 where it lies far off its neighbours.
absl::StatusOr<std::vector<float>> FarOff(const OrientedCloud& cloud, const NeighborGraph& graph,
                                          const RunContext& context) {
  std::vector<float> off(static_cast<size_t>(graph.size())), in_spacings(off.size());
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kSearchBlock, context, [&](int64_t i) {
    off[i] = OffNeighbors(cloud, graph, static_cast<int>(i));
    in_spacings[i] = off[i] / cloud.spacing[i];
  }));
  const float least = kFindFoliage.off_median * Median(off);
  const float least_spacings =
      std::max(kFindFoliage.off_spacing, kFindFoliage.off_median * Median(in_spacings));
  for (size_t i = 0; i < off.size(); ++i) {
    off[i] = off[i] > least && in_spacings[i] > least_spacings ? 1 : 0;
  }
  return off;
}

// Per point, kFindFoliage.volume_rings less the rings from the nearest marked point; 0 where it is
// farther off.
std::vector<uint8_t> RingsAround(const NeighborGraph& graph, const std::vector<uint8_t>& marked) {
  std::vector<uint8_t> rings(marked.size(), 0);
  std::vector<int> front, next;
  for (int i = 0; i < graph.size(); ++i) {
    if (marked[i]) front.push_back(i);
  }
  for (int ring = kFindFoliage.volume_rings; ring > 0; --ring, front.swap(next)) {
    next.clear();
    for (const int i : front) {
      if (rings[i] >= ring) continue;
      rings[i] = static_cast<uint8_t>(ring);
      for (const int j : graph.neighbors(i)) {
        if (rings[j] == 0) next.push_back(j);
      }
    }
  }
  return rings;
}

// The patch of a point whose neighbours have these, one ring wider.
PatchMoments Widened(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                     const std::vector<PatchMoments>& patches, int64_t point) {
  PatchSum sum;
  sum.Add(patches[point], Eigen::Vector3d::Zero());
  for (const int j : graph.neighbors(static_cast<int>(point))) {
    sum.Add(patches[j], points.col(j) - points.col(point));
  }
  return sum.Mean();
}

bool IsVolume(const PatchMoments& patch) {
  const PatchPlane plane = FitPlane(patch);
  return plane.thickness > kFindFoliage.volume * kFindFoliage.volume * plane.spread;
}

// Which of the marked points lie in a volume of points, both near and far around them.
absl::StatusOr<std::vector<uint8_t>> InVolumes(const OrientedCloud& cloud,
                                               const NeighborGraph& graph,
                                               const std::vector<uint8_t>& marked,
                                               const RunContext& context) {
  std::vector<uint8_t> in_volume = marked;
  const std::vector<uint8_t> rings = RingsAround(graph, marked);
  std::vector<PatchMoments> patches(marked.size()), wider(marked.size());
  for (int ring = 1; ring <= kFindFoliage.volume_rings; ++ring) {
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kSearchBlock, context, [&](int64_t i) {
      if (rings[i] < ring) return;
      wider[i] = Widened(cloud.points, graph, patches, i);
      if (!in_volume[i] || (ring != kFindFoliage.rings && ring != kFindFoliage.volume_rings))
        return;
      in_volume[i] = IsVolume(wider[i]);
    }));
    patches.swap(wider);
  }
  return in_volume;
}

// Removes components with too few points deep in volumes.
absl::Status RemoveDetails(const NeighborGraph& graph, const std::vector<uint8_t>& in_volume,
                           const RunContext& context, std::vector<uint8_t>* foliage) {
  SignedUnionFind sets(graph.size());
  RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t index) {
    const int i = static_cast<int>(index);
    if (!(*foliage)[i]) return;
    for (const int j : graph.neighbors(i)) {
      if ((*foliage)[j]) sets.Join(i, j, 0);
    }
  }));
  std::vector<int> leaves(foliage->size());
  for (int i = 0; i < graph.size(); ++i) {
    const auto around = graph.neighbors(i);
    const bool deep = in_volume[i] && std::all_of(around.begin(), around.end(),
                                                  [&](int j) { return in_volume[j] != 0; });
    leaves[sets.Find(i)] += deep ? 1 : 0;
  }
  for (int i = 0; i < graph.size(); ++i) {
    if (leaves[sets.Find(i)] < kFindFoliage.fewest_leaves) (*foliage)[i] = 0;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<bool> MayHoldFoliage(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                    const RunContext& context) {
  if (IsLeftOut(Mechanism::kFoliage)) return false;
  std::vector<PatchMoments> patches(static_cast<size_t>(graph.size())), wider(patches.size());
  for (int ring = 0; ring < kFindFoliage.rings; ++ring) {
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kSearchBlock, context, [&](int64_t i) {
      wider[i] = Widened(points, graph, patches, i);
    }));
    patches.swap(wider);
  }
  std::atomic<int64_t> in_volume = 0;
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kSearchBlock, context, [&](int64_t i) {
    if (IsVolume(patches[i])) ++in_volume;
  }));
  return in_volume >= kFindFoliage.fewest_leaves;
}

absl::StatusOr<std::vector<uint8_t>> FindFoliage(const OrientedCloud& cloud,
                                                 const NeighborGraph& graph,
                                                 const RunContext& context) {
  const int64_t count = graph.size();
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> share, FarOff(cloud, graph, context));
  std::vector<float> around(share.size());
  for (int ring = 0; ring < kFindFoliage.rings; ++ring) {
    RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
      float sum = share[i];
      for (const int j : graph.neighbors(static_cast<int>(i))) sum += share[j];
      around[i] = sum / static_cast<float>(graph.k + 1);
    }));
    share.swap(around);
  }
  std::vector<uint8_t> foliage(share.size());
  std::transform(share.begin(), share.end(), foliage.begin(),
                 [](float off) { return static_cast<uint8_t>(off > kFindFoliage.most_off); });
  if (std::find(foliage.begin(), foliage.end(), 1) == foliage.end()) return std::vector<uint8_t>();
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> in_volume,
                           InVolumes(cloud, graph, foliage, context));
  RILIEVO_RETURN_IF_ERROR(RemoveDetails(graph, in_volume, context, &foliage));
  return foliage;
}

}  // namespace rilievo
