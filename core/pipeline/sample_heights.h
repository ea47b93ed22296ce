// Heights over the smooth surface.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/control/control_options.h"
#include "core/pipeline/fit_domain.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

struct SampledSurface {
  Domain domain;             // the one given, or cut and fitted once more
  DisplacedSurface surface;  // over its mesh, rounded
  Shape shape;               // of the finest level, unit frame; may be empty without measuring
  double leverage = 1;       // as in SolvedHeights
};

// The level, 1 to 6, whose displaced vertices are about as dense as so many points.
int LevelAsDenseAs(double points, int64_t control_faces);

// The level of a surface of a scan of `points` points, of median `spacing` and `noise`:
// options.max_level, or as dense as the points, where noise leaves them worth it.
// RESOURCE_EXHAUSTED when the level asked for has more than max_surface_faces.
absl::StatusOr<int> LevelFor(const ReconstructOptions& options, int64_t points, double spacing,
                             double noise, int64_t control_faces);

// Heights along the limit normals of the domain. Where the scan turns out to have an opening, a
// domain of `topology` kArbitrary is cut, fitted and sampled once more; the other topologies know
// their borders beforehand. RESOURCE_EXHAUSTED when the level asked for has more than
// max_surface_faces.
absl::StatusOr<SampledSurface> SampleHeights(const ScanSurface& scan, Topology topology,
                                             Domain domain, const ReconstructOptions& options,
                                             const PipelineContext& context);

}  // namespace rilievo
