// A .dss whose vertices of one level were moved.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/domain/edit_level.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct EditedLevel {
  std::vector<uint8_t> dss;
  TargetsMissed missed;  // by the vertices that `dss` decodes to, in any direction
};

// The surface of a whole .dss with the vertices of `level` (the mesh of Tessellate(), [0,
// max_level]) where `edited` has them, scan frame: control points by least squares, the rest in
// heights, detail of the finer levels as before (domain/edit_level.h). Control points are rounded
// to the step of the file before the heights are taken; heights are coded with half the step that
// those of its finest level have, but none below 1e-5 of the diagonal for that. Filled heights that
// move by more than the step of the control points become smoothed ones. Groups stay. What the file
// says of its scan goes. An edit that changes nothing, but for digits lost in text or floats, gives
// the same bytes.
//
// INVALID_ARGUMENT for another level, when vertices or faces are not those of the level, and when
// heights get too large; FAILED_PRECONDITION for a file without its finest levels, or when the
// vertices do not determine the control points. Else the errors of DecodeDss.
absl::StatusOr<EditedLevel> EditLevel(std::span<const uint8_t> dss, int level,
                                      const TriangleMesh& edited, const RunContext& context);

}  // namespace rilievo
