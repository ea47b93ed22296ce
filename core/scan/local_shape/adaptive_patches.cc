#include "core/scan/local_shape/adaptive_patches.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

struct Widener {
  const Eigen::Matrix3Xd& points;
  const NeighborGraph& graph;
  const std::vector<float>& noise;
  int base_count;  // points in a patch before the first round
  std::vector<PatchPlane>& planes;
  std::vector<float> base_spread = {};

  // Standard error of the normal; the points of a patch grow with its area.
  double NormalError(int i) const {
    const double spread = planes[i].spread;
    if (!(spread > 0) || !(base_spread[i] > 0)) return 0;
    return noise[i] / std::sqrt(base_count * (spread / base_spread[i]) * spread);
  }

  bool NeedsWidening(int i, double error) const {
    return error > kAdaptivePatches.normal_error ||
           (error > kAdaptivePatches.normal_error / 2 &&
            planes[i].thickness > kAdaptivePatches.thick * planes[i].spread);
  }

  // The patches of the point and of those neighbours whose planes agree within what their errors
  // explain: two sides of an edge stay apart.
  PatchMoments Widened(int i, const std::vector<PatchMoments>& patches, double error) const {
    const bool trusted = error < kAdaptivePatches.trusted_error &&
                         planes[i].thickness < kAdaptivePatches.thick * planes[i].spread;
    const double agreement =
        trusted ? std::cos(std::max(kAdaptivePatches.sharpest_bend, 4 * error)) : 0.0;
    PatchSum sum;
    sum.Add(patches[i], Eigen::Vector3d::Zero());
    for (const int j : graph.neighbors(i)) {
      if (std::abs(planes[i].normal.dot(planes[j].normal)) < agreement) continue;
      sum.Add(patches[j], points.col(j) - points.col(i));
    }
    return sum.Mean();
  }

  absl::Status Run(const RunContext& context, std::vector<PatchMoments>* patches) {
    const auto count = static_cast<int64_t>(patches->size());
    base_spread.resize(patches->size());
    std::transform(planes.begin(), planes.end(), base_spread.begin(),
                   [](const PatchPlane& plane) { return static_cast<float>(plane.spread); });
    std::vector<PatchMoments> wider(patches->size());
    std::vector<uint8_t> widened(patches->size());
    for (int round = 0; round < kAdaptivePatches.max_rounds; ++round) {
      RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t at) {
        const int i = static_cast<int>(at);
        const double error = NormalError(i);
        widened[i] = NeedsWidening(i, error);
        wider[i] = widened[i] ? Widened(i, *patches, error) : (*patches)[i];
      }));
      if (std::find(widened.begin(), widened.end(), 1) == widened.end()) break;
      patches->swap(wider);
      RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
        if (widened[i]) planes[i] = FitPlane((*patches)[i]);
      }));
    }
    return absl::OkStatus();
  }
};

// Every n-th point along the Morton curve, so that noise is no thicker than what is left of the
// spacing, which grows with the root of n.
int Stride(const std::vector<float>& noise, const std::vector<float>& spacing) {
  std::vector<float> ratios(noise.size());
  for (size_t i = 0; i < noise.size(); ++i) {
    ratios[i] = spacing[i] > 0 ? noise[i] / spacing[i] : 0;
  }
  const double excess = Median(std::move(ratios)) / kAdaptivePatches.thinning_ratio;
  return std::clamp(static_cast<int>(std::ceil(excess * excess)), 1, kAdaptivePatches.max_stride);
}

// The widened patches of the thinned points, as the other points see them: the sum of those in
// their lists, or the nearest.
absl::Status SpreadToAll(const Eigen::Matrix3Xd& points, const NeighborGraph& graph, int stride,
                         const PointIndex& thinned, const std::vector<PatchMoments>& wide,
                         const RunContext& context, std::vector<PatchMoments>* patches,
                         std::vector<PatchPlane>* planes) {
  return ParallelForEach(points.cols(), kSearchBlock, context, [&](int64_t i) {
    PatchSum sum;
    const auto add = [&](int thin) {
      sum.Add(wide[thin], points.col(static_cast<int64_t>(thin) * stride) - points.col(i));
    };
    bool found = i % stride == 0;
    if (found) add(static_cast<int>(i / stride));
    for (const int j : graph.neighbors(static_cast<int>(i))) {
      if (j % stride != 0) continue;
      add(j / stride);
      found = true;
    }
    if (!found) {
      int nearest = 0;
      double squared = 0;
      thinned.Nearest(points.col(i), 1, &nearest, &squared);
      add(nearest);
    }
    (*patches)[i] = sum.Mean();
    (*planes)[i] = FitPlane((*patches)[i]);
  });
}

}  // namespace

absl::Status AdaptPatches(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                          const std::vector<float>& noise, const std::vector<float>& spacing,
                          const RunContext& context, std::vector<PatchMoments>* patches,
                          std::vector<PatchPlane>* planes) {
  if (IsLeftOut(Mechanism::kAdaptivePatches)) return absl::OkStatus();
  const int base_count = graph.k + 1;
  const int64_t stride = Stride(noise, spacing);
  const int64_t thinned_count = (points.cols() + stride - 1) / stride;
  if (stride == 1 || thinned_count <= graph.k) {
    return Widener{points, graph, noise, base_count, *planes}.Run(context, patches);
  }
  Eigen::Matrix3Xd thinned(3, thinned_count);
  std::vector<float> thinned_noise(static_cast<size_t>(thinned_count));
  std::vector<PatchMoments> wide(static_cast<size_t>(thinned_count));
  std::vector<PatchPlane> wide_planes(static_cast<size_t>(thinned_count));
  for (int64_t i = 0; i < thinned_count; ++i) {
    thinned.col(i) = points.col(i * stride);
    thinned_noise[i] = noise[i * stride];
    wide[i] = (*patches)[i * stride];
    wide_planes[i] = (*planes)[i * stride];
  }
  RILIEVO_ASSIGN_OR_RETURN(const PointIndex index, PointIndex::Build(thinned, context));
  RILIEVO_ASSIGN_OR_RETURN(const NeighborGraph thinned_graph,
                           BuildNeighborGraph(index, thinned, NeighborOptions{}, context));
  Widener widener{thinned, thinned_graph, thinned_noise, base_count, wide_planes};
  RILIEVO_RETURN_IF_ERROR(widener.Run(context, &wide));
  return SpreadToAll(points, graph, static_cast<int>(stride), index, wide, context, patches,
                     planes);
}

}  // namespace rilievo
