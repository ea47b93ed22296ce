#include "core/pipeline/finished_surface.h"

#include <optional>
#include <utility>

#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<FinishedSurface> FinishSurface(CodedSurface coded, OrientedCloud cloud, Shape mesh,
                                              const ReconstructOptions& options,
                                              const PipelineContext& context) {
  FinishedSurface finished;
  for (const HeightSource source : coded.surface.sources) {
    ++finished.source_counts[static_cast<size_t>(source)];
  }
  std::optional<Shape> points;
  if (options.measure) {
    points = mesh.triangles.cols() > 0 ? std::move(mesh) : PointsToMeasure(std::move(cloud));
  }
  RILIEVO_ASSIGN_OR_RETURN(finished.certified, Certify(std::move(coded.encoded), coded.metadata,
                                                       std::move(points), context));
  finished.coded = std::move(coded);
  return finished;
}

}  // namespace rilievo
