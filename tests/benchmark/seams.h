// What a surface shows of the borders between its groups of control faces.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace rilievo {

// Over the finest edges along control edges of one kind whose triangles on both sides have no
// filled corner.
struct EdgeFigures {
  int64_t control_edges = 0;
  double angle = 0;  // RMS between the normals of the two triangles, radians
  double bend = 0;   // RMS of the heights' second difference: both far corners less both ends
};

struct SeamFigures {
  EdgeFigures border, inside;  // between two groups, within one
  double AngleRatio() const { return border.angle / inside.angle; }
  double BendRatio() const { return border.bend / inside.bend; }
};

// Of a .dss file. FAILED_PRECONDITION where it has no groups or a single level.
absl::StatusOr<SeamFigures> MeasureSeams(std::span<const uint8_t> dss, const RunContext& context);

}  // namespace rilievo
