// Heights of a block of rays: the walk to the ray, the virtual triangle, on noisy scans the fit.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/displacement/displacement_options.h"
#include "core/displacement/local_fit/local_fit.h"
#include "core/displacement/local_fit/scale_selection.h"
#include "core/displacement/rays/height_samples.h"
#include "core/displacement/rays/neighbor_queue.h"
#include "core/displacement/rays/ray_cloud.h"

namespace rilievo {

struct RaySample {
  Ray ray;
  HeightEstimate estimate;
};

// Whether the local fit takes the place of the bare triangle there.
bool IsNoisy(const RayPoint& point, const DisplacementOptions& options);
// The noise, in spacings, above which the triangle is worth improving by a local fit that agrees
// with it.
float LeastNoiseWorthFitting(const DisplacementOptions& options);
bool IsWorthFitting(const RayPoint& point, const DisplacementOptions& options);

// Not for use by two threads at once: holds the scratch of its queue and fits.
class HeightSampler {
 public:
  HeightSampler(const RayCloud& cloud, const NeighborGraph& graph,
                const DisplacementOptions& options);

  // The height of the virtual triangle. `start`: a cloud point from which the way to the ray leads
  // ever nearer, as any on the same side of a convex part does; `reference`: where the surface is
  // expected (the coarser level's height). None when the ray pierces no virtual triangle.
  std::optional<HeightEstimate> Pierce(const Ray& ray, int start, float reference);

  // Replaces the estimates by local fits where that succeeds. Rays that lie close together share
  // the points that one of them gathers; all together, best of one region, show how wide its
  // detail is (SelectScalesTogether).
  void Refine(std::span<RaySample> samples);

 private:
  std::optional<HeightEstimate> PierceOnce(const Ray& ray, int start, QueueGate gate);
  // Rays that hit nearly the same place, facing nearly the same way.
  std::vector<RayGroup> GroupRays(std::span<const RaySample> samples);
  void FitGroup(std::span<const RaySample> samples, const RayGroup& group);

  const RayCloud& cloud_;
  DisplacementOptions options_;
  NeighborQueue queue_;
  LocalFitter fitter_;
  std::vector<int> waiting_;
  std::vector<MultiscaleFit> fits_;  // by sample
};

}  // namespace rilievo
