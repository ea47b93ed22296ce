// One height: the walk to the ray, the virtual triangle, and on noisy scans the local fit.
#pragma once

#include <optional>

#include "core/displacement/local_fit.h"
#include "core/displacement/neighbor_queue.h"
#include "core/displacement/ray_cloud.h"
#include "core/displacement/sample_displacement.h"

namespace rilievo {

struct HeightBounds {
  float lowest, highest;
};

struct HeightEstimate {
  float height;
  float deviation;  // expected standard deviation of `height`
  float spacing;    // of the points there
  int foot;         // cloud point nearest to where the ray meets the surface
};

// Not for use by two threads at once: holds the scratch of its queue and fits.
class HeightSampler {
 public:
  HeightSampler(const RayCloud& cloud, const NeighborGraph& graph,
                const DisplacementOptions& options);

  // `start`: any cloud point, the nearer the better. `reference`: where the surface is expected
  // (the coarser level's height). `always_fit`: the robust local fit whatever the noise. None when
  // the ray pierces no virtual triangle, or the surface lies outside `bounds`.
  std::optional<HeightEstimate> Sample(const Ray& ray, const HeightBounds& bounds, int start,
                                       float reference, bool always_fit = false);

 private:
  std::optional<HeightEstimate> Pierce(const Ray& ray, int start, float reference);
  void Fit(const Ray& ray, float noise, HeightEstimate* estimate);

  const RayCloud& cloud_;
  DisplacementOptions options_;
  NeighborQueue queue_;
  LocalFitter fitter_;
};

}  // namespace rilievo
