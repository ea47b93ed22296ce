// The passes over the domain's vertices: pierce, refine, despike.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/displacement/regularize/height_bounds.h"
#include "core/displacement/sampling/height_sampler.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/loop/split_normals.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Keeps references to all it is given. Each pass runs on the context's threads, and its result does
// not depend on their number.
class DomainSampling {
 public:
  DomainSampling(const RayCloud& cloud, const NeighborGraph& graph, const PointIndex& index,
                 const LoopRefinement& refinement, const LevelRings& rings,
                 const LimitSurface& limit, const DisplacementOptions& options,
                 const RunContext& context);

  // Virtual triangles and creases, coarse to fine: the heights of a level tell the next one where
  // to look. Reports progress up to `progress_end`.
  absl::Status IntersectNormals(double progress_end);

  // Local fits where the points are noisy. Where the last level but one came out as predicted by
  // those before, the finest level is predicted too: fits there would repeat the same points'
  // noise.
  absl::Status RefineNoisy();

  // Measures spikes again by the local fit near their ring's height; what still stands out, or what
  // the points contradict, is given to the filling. In turns, as a spike hides its neighbours.
  absl::Status Despike();

  // On the domain's creases and in its corners: where the planes of the sides meet, unless the
  // crease fit found it; beside the creases of noisy scans the planes of the sides themselves.
  absl::Status MeetSides(const OrientedCloud& cloud);

  HeightSamples& samples() { return samples_; }

  // The height, or the bound that it lies beyond.
  float Bounded(int vertex, float height) const;

 private:
  bool IsInCommonBounds(int vertex, float height) const;
  bool WantsFit(int vertex) const;
  absl::Status FitSides(const OrientedCloud& cloud, const SharpSectors& sectors);
  absl::Status Refine(std::vector<int> vertices);
  std::vector<int> TakePredicted();    // finest vertices that still want a fit
  absl::StatusOr<bool> DespikeOnce();  // whether there were spikes
  bool IsContradicted(int vertex, float height) const;
  Ray RayOf(int vertex) const;
  HeightEstimate EstimateOf(int vertex) const;
  // What lies outside its bounds was not measured.
  bool IsInBounds(int vertex, float height) const;
  void Store(int vertex, const std::optional<HeightEstimate>& estimate);
  int StartFromIndex(const Ray& ray, int vertex, float reference) const;
  std::optional<HeightEstimate> PierceVertex(int vertex, const MeshTopology* coarser,
                                             HeightSampler* sampler) const;

  const RayCloud& cloud_;
  const NeighborGraph& graph_;
  const PointIndex& index_;
  const LoopRefinement& refinement_;
  const LevelRings rings_;
  const LimitSurface& limit_;
  const DisplacementOptions& options_;
  const RunContext& context_;
  // Within the bounds of every one of so many vertices in a row: nearly all heights are.
  static constexpr int kInCommon = 64;
  std::vector<HeightBounds> common_bounds_;
  HeightSamples samples_;
};

}  // namespace rilievo
