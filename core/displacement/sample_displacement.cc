#include "core/displacement/sample_displacement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/local_fit/calibrate_noise.h"
#include "core/displacement/rays/ray_cloud.h"
#include "core/displacement/regularize/fill_heights.h"
#include "core/displacement/regularize/fit_missed_points.h"
#include "core/displacement/regularize/input_laplacian.h"
#include "core/displacement/regularize/project_to_points.h"
#include "core/displacement/regularize/retract_heights.h"
#include "core/displacement/sampling/domain_sampling.h"
#include "core/displacement/sampling/height_sampler.h"

namespace rilievo {
namespace {

absl::Status CheckInput(const OrientedCloud& cloud, const NeighborGraph& graph,
                        const PointIndex& index, const LoopRefinement& refinement,
                        const LimitSurface& limit) {
  const int64_t count = cloud.points.cols();
  if (count == 0 || cloud.normals.cols() != count ||
      static_cast<int64_t>(cloud.spacing.size()) != count ||
      static_cast<int64_t>(cloud.noise.size()) != count) {
    return absl::InvalidArgumentError(absl::StrCat(
        "cloud: ", count, " points, ", cloud.normals.cols(), " normals, ", cloud.spacing.size(),
        " spacings, ", cloud.noise.size(), " noises; all four must be equal and not 0"));
  }
  if (graph.size() != count || index.size() != count) {
    return absl::InvalidArgumentError(absl::StrCat("graph and index: made for ", graph.size(),
                                                   " and ", index.size(), " points, not for ",
                                                   count));
  }
  const int vertices = refinement.levels.empty() ? 0 : refinement.levels.back().vertex_count;
  if (vertices == 0 || limit.positions.cols() != vertices || limit.normals.cols() != vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat("limit: ", limit.positions.cols(), " positions and ", limit.normals.cols(),
                     " normals; the finest level has ", vertices, " vertices"));
  }
  if (!limit.positions.allFinite() || !limit.normals.allFinite()) {
    return absl::InvalidArgumentError("limit: positions or normals are not finite");
  }
  return absl::OkStatus();
}

// Back within their bounds, after smoothing and filling.
absl::Status KeepWithinBounds(const DomainSampling& sampling, const RunContext& context,
                              std::vector<float>* heights) {
  constexpr int64_t kBlock = 4096;
  return ParallelFor(static_cast<int64_t>(heights->size()), kBlock, context,
                     [&](int64_t begin, int64_t end) {
                       for (int64_t v = begin; v < end; ++v) {
                         float& height = (*heights)[v];
                         if (!std::isfinite(height)) height = 0;
                         height = sampling.Bounded(static_cast<int>(v), height);
                       }
                     });
}

DisplacementField MakeField(const std::vector<float>& sampled, HeightSamples samples) {
  DisplacementField field;
  const int count = samples.size();
  field.source.resize(count);
  for (int v = 0; v < count; ++v) {
    if (!samples.measured[v]) {
      field.source[v] = HeightSource::kFilled;
      ++field.filled;
    } else if (samples.fitted[v] ||
               std::abs(samples.height[v] - sampled[v]) > samples.deviation[v]) {
      field.source[v] = HeightSource::kSmoothed;
      ++field.smoothed;
    } else {
      field.source[v] = HeightSource::kMeasured;
      ++field.measured;
    }
  }
  field.heights = std::move(samples.height);
  return field;
}

}  // namespace

absl::StatusOr<DisplacementField> SampleDisplacement(
    const OrientedCloud& cloud, const NeighborGraph& graph, const PointIndex& index,
    const LoopRefinement& refinement, const LevelRings& rings, const LimitSurface& limit,
    const DisplacementOptions& options, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckInput(cloud, graph, index, refinement, limit));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  context.Report(Stage::kDisplacement, 0.0);
  RILIEVO_ASSIGN_OR_RETURN(RayCloud ray_cloud, PrepareRayCloud(cloud, graph, context));
  RILIEVO_RETURN_IF_ERROR(
      CalibrateNoise(graph, LeastNoiseWorthFitting(options), context, &ray_cloud));
  DomainSampling sampling(ray_cloud, graph, index, refinement, rings, limit, options, context);
  RILIEVO_RETURN_IF_ERROR(sampling.IntersectNormals(0.5));
  RILIEVO_RETURN_IF_ERROR(sampling.RefineNoisy());
  context.Report(Stage::kDisplacement, 0.8);
  RILIEVO_RETURN_IF_ERROR(sampling.Despike());
  RILIEVO_RETURN_IF_ERROR(sampling.MeetSides(cloud));
  RILIEVO_RETURN_IF_ERROR(sampling.Despike());
  ray_cloud = RayCloud();  // no more sampling
  HeightSamples& samples = sampling.samples();
  const std::vector<float> sampled = samples.height;
  RILIEVO_RETURN_IF_ERROR(
      SmoothHeights(refinement.levels.back(), rings, options.smoothing_rounds, context, &samples));
  context.Report(Stage::kDisplacement, 0.9);
  RILIEVO_RETURN_IF_ERROR(FillHeights(refinement, samples.measured, context, &samples.height));
  RILIEVO_RETURN_IF_ERROR(
      ProjectToPoints(cloud, index, limit, LeastNoiseWorthFitting(options), context, &samples));
  RILIEVO_RETURN_IF_ERROR(KeepWithinBounds(sampling, context, &samples.height));
  RILIEVO_RETURN_IF_ERROR(RetractHeights(cloud, index, limit, context, &samples));
  const auto bounded = [&](int v, float height) { return sampling.Bounded(v, height); };
  RILIEVO_RETURN_IF_ERROR(
      FitMissedPoints(cloud, graph, refinement, rings, limit, bounded, context, &samples));
  context.Report(Stage::kDisplacement, 1.0);
  return MakeField(sampled, std::move(samples));
}

}  // namespace rilievo
