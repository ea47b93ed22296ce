#include "core/pipeline/color_surface.h"

#include <algorithm>

#include "core/base/status_macros.h"
#include "core/displacement/sample_colors.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

absl::StatusOr<std::vector<Rgb>> ColorsOf(const DisplacedSurface& surface,
                                          const OrientedCloud& cloud, std::span<const Rgb> colors,
                                          const ReconstructOptions& options,
                                          const PipelineContext& context) {
  const StageScope scope(Stage::kDisplacement, context);
  const ControlMesh& mesh = surface.control_mesh;
  const int level = surface.max_level;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineToVertices(mesh, level, context));
  const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
  const LevelRings rings =
      level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, mesh.vertices, level, context));
  return SampleColors(cloud, colors, refinement, rings, limit, options.displacement, context);
}

}  // namespace

ReconstructOptions WithRoomForColors(ReconstructOptions options) {
  if (options.encode.max_bytes)
    *options.encode.max_bytes -= *options.encode.max_bytes / kColorSurface.color_part;
  return options;
}

absl::StatusOr<CodedColors> ColorSurface(const OrientedCloud& cloud, std::span<const Rgb> colors,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context, CodedSurface* coded) {
  const PipelineContext silent = context.Silent();  // its stages are over
  RILIEVO_ASSIGN_OR_RETURN(coded->surface.colors,
                           ColorsOf(coded->surface, cloud, colors, options, silent));
  const StageScope scope(Stage::kEncode, silent);
  const std::optional<int64_t> most = options.encode.max_bytes;
  RILIEVO_ASSIGN_OR_RETURN(CodedColors colors_coded,
                           AddColors(coded->surface, most, silent, &coded->encoded));
  if (!most || *most - BytesOf(coded->encoded) < *most / kColorSurface.worth_of_heights)
    return colors_coded;
  ReconstructOptions rest = options;
  *rest.encode.max_bytes -= colors_coded.bytes;
  RILIEVO_ASSIGN_OR_RETURN(coded->encoded, CodeWithinBytes(*coded, rest, silent));
  return AddColors(coded->surface, most, silent, &coded->encoded);
}

}  // namespace rilievo
