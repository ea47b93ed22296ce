#include "core/scan/clean/find_foliage.h"

#include <algorithm>
#include <cmath>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/scan/local_shape/patch_moments.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// Of the distances to the planes of the neighbours. As many are of a point's own sheet.
constexpr double kOwnSheet = 0.4;
// How far off the planes foliage is: in spacings, and in the scan's median.
constexpr float kOffSpacing = 0.2F, kOffMedian = 4;
// Points whose neighbourhoods of so many rings hold more such points belong to it.
constexpr int kRings = 2;
constexpr float kMostOff = 1.0F / 3;
// Deviation across the plane of such a neighbourhood, in that along it.
constexpr double kVolume = 0.35;
// Components with fewer points in volumes are details.
constexpr int kFewestLeaves = 150;

// How far a point is from the tangent planes of its neighbours, in spacings.
float OffNeighborPlanes(const OrientedCloud& cloud, const NeighborGraph& graph, int point) {
  float distances[kMostNeighbors];
  int count = 0;
  for (const int j : graph.neighbors(point)) {
    const double distance = cloud.normals.col(j).dot(cloud.points.col(point) - cloud.points.col(j));
    distances[count++] = static_cast<float>(std::abs(distance));
  }
  float* const chosen = distances + static_cast<int>(kOwnSheet * count);
  std::nth_element(distances, chosen, distances + count);
  return *chosen / cloud.spacing[point];
}

// Whether the points two rings around one fill a volume. Those along an edge, a rod or the sheets
// of a wall do not.
bool IsInVolume(const OrientedCloud& cloud, const NeighborGraph& graph, int point) {
  PatchSum sum;
  const auto add = [&](int i) {
    sum.Add(PatchMoments(), cloud.points.col(i) - cloud.points.col(point));
  };
  add(point);
  for (const int j : graph.neighbors(point)) {
    add(j);
    for (const int k : graph.neighbors(j)) add(k);
  }
  const PatchPlane plane = FitPlane(sum.Mean());
  return plane.thickness > kVolume * kVolume * plane.spread;
}

// Takes the components out that have too few points in volumes.
absl::Status KeepVolumes(const NeighborGraph& graph, const std::vector<uint8_t>& in_volume,
                         const RunContext& context, std::vector<uint8_t>* foliage) {
  SignedUnionFind sets(graph.size());
  RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t index) {
    const int i = static_cast<int>(index);
    if (!(*foliage)[i]) return;
    for (const int j : graph.neighbors(i)) {
      if ((*foliage)[j]) sets.Join(i, j, 0);
    }
  }));
  std::vector<int> volume(foliage->size());
  for (int i = 0; i < graph.size(); ++i) volume[sets.Find(i)] += in_volume[i];
  for (int i = 0; i < graph.size(); ++i) {
    if (volume[sets.Find(i)] < kFewestLeaves) (*foliage)[i] = 0;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> FindFoliage(const OrientedCloud& cloud,
                                                 const NeighborGraph& graph,
                                                 const RunContext& context) {
  if (IsLeftOut(Mechanism::kFoliage)) return std::vector<uint8_t>();
  const int64_t count = graph.size();
  std::vector<float> share(static_cast<size_t>(count)), around(share.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          around[i] = share[i] = OffNeighborPlanes(cloud, graph, static_cast<int>(i));
        }
      }));
  std::nth_element(around.begin(), around.begin() + count / 2, around.end());
  const float limit = std::max(kOffSpacing, kOffMedian * around[count / 2]);
  for (float& off : share) off = off > limit ? 1 : 0;
  for (int ring = 0; ring < kRings; ++ring) {
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
          for (int64_t i = begin; i < end; ++i) {
            float sum = share[i];
            for (const int j : graph.neighbors(static_cast<int>(i))) sum += share[j];
            around[i] = sum / static_cast<float>(graph.k + 1);
          }
        }));
    share.swap(around);
  }
  std::vector<uint8_t> is_off(share.size()), in_volume(share.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          is_off[i] = share[i] > kMostOff;
          in_volume[i] = is_off[i] != 0 && IsInVolume(cloud, graph, static_cast<int>(i));
        }
      }));
  RILIEVO_RETURN_IF_ERROR(KeepVolumes(graph, in_volume, context, &is_off));
  return is_off;
}

}  // namespace rilievo
