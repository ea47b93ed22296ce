// From discs to a surface: the look of a point set without normals.
#pragma once

#include "absl/status/status.h"
#include "client/picture/camera.h"
#include "client/picture/raster.h"
#include "core/base/run_context.h"

namespace rilievo {

// The raster holds discs of about `radius` samples with plain colours. Closes gaps between discs
// that show what lies behind, smooths the depths within a disc's reach, takes normals from them and
// shades as Shade() does, darker in creases (eye-dome lighting, Boucheny 2009).
absl::Status ShadePoints(const Projection& projection, float radius, const RunContext& context,
                         Raster* raster);

}  // namespace rilievo
