// The colours of a scan on its surface.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/codec/container/colors.h"
#include "core/geometry/rgb.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The options for the shape of a surface that is coloured afterwards: some of the bytes asked for
// are left to the colours.
ReconstructOptions WithRoomForColors(ReconstructOptions options);

// Gives coded->surface the colours of the cloud's points, and codes them. Bytes that they leave of
// those asked for go to the heights, which are coded once more. `options`: as asked for.
absl::StatusOr<CodedColors> ColorSurface(const OrientedCloud& cloud, std::span<const Rgb> colors,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context, CodedSurface* coded);

}  // namespace rilievo
