#include "core/displacement/sample_displacement.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "absl/status/status.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/displacement/regularize/height_bounds.h"
#include "core/displacement/solve_heights.h"

namespace rilievo {
namespace {

absl::Status KeepWithinBounds(const LevelRings& rings, const LimitSurface& limit, double max_height,
                              const RunContext& context, std::vector<float>* heights) {
  return ParallelForEach(
      static_cast<int64_t>(heights->size()), kLightBlock, context, [&](int64_t v) {
        float& height = (*heights)[v];
        const HeightBounds bounds = BoundsOf(static_cast<int>(v), rings, limit, max_height);
        height = std::isfinite(height) ? std::clamp(height, bounds.lowest, bounds.highest) : 0.0f;
      });
}

DisplacementField MakeField(SolvedHeights solved) {
  DisplacementField field;
  const size_t count = solved.height.size();
  field.source.resize(count);
  for (size_t v = 0; v < count; ++v) {
    field.source[v] = !solved.measured[v]  ? HeightSource::kFilled
                      : solved.smoothed[v] ? HeightSource::kSmoothed
                                           : HeightSource::kMeasured;
  }
  CountSources(&field);
  field.heights = std::move(solved.height);
  field.leverage = solved.leverage;
  return field;
}

}  // namespace

void CountSources(DisplacementField* field) {
  field->measured = std::count(field->source.begin(), field->source.end(), HeightSource::kMeasured);
  field->smoothed = std::count(field->source.begin(), field->source.end(), HeightSource::kSmoothed);
  field->filled = std::ssize(field->source) - field->measured - field->smoothed;
}

absl::StatusOr<DisplacementField> SampleDisplacement(
    const OrientedCloud& cloud, const LoopRefinement& refinement, const LevelRings& rings,
    const LimitSurface& limit, const DisplacementOptions& options, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  context.Report(Stage::kDisplacement, 0.0);
  RILIEVO_ASSIGN_OR_RETURN(SolvedHeights solved,
                           SolveHeights(cloud, refinement, rings, limit, options, context));
  context.Report(Stage::kDisplacement, 0.9);
  RILIEVO_RETURN_IF_ERROR(
      KeepWithinBounds(rings, limit, options.max_height, context, &solved.height));
  context.Report(Stage::kDisplacement, 1.0);
  return MakeField(std::move(solved));
}

}  // namespace rilievo
