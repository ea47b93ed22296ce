// Displaced surfaces in the formats that know subdivision, and as pictures of their heights.
#pragma once

#include <ostream>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// Creases and corners as lines of an OBJ: see WriteObjCage().
void WriteObjTags(const std::vector<Crease>& creases, const std::vector<int>& corners,
                  std::ostream& out);

// The control mesh as OBJ, scan frame, with its creases and corners as OpenSubdiv's tags
// ("t crease 2/1/0 a b sharpness", "t corner 1/1/0 v sharpness", vertices counted from 0), which
// other readers pass over.
absl::Status WriteObjCage(const ControlMesh& mesh, const SpatialFrame& frame, std::ostream& out);

// USD as text: a Mesh with subdivisionScheme "loop" whose limit is the surface without heights. Its
// points are the control mesh subdivided `level` times, [0, max_level], which leaves the limit as
// it is; creases and corners keep what is left of their sharpness. The heights of these vertices
// are the primvar `displacement` (scan unit, along the limit normal, "varying": linear between the
// vertices), their origin the primvar `heightSource` (see HeightSource). Points are float about the
// frame's centre, which is the translation in double. metersPerUnit and upAxis are those of `place`
// (a metre and Z where it does not say); a way up that USD has no word for is turned to Y.
absl::Status WriteUsdSurface(const DisplacedSurface& surface, int level, const ScanPlace& place,
                             const RunContext& context, std::ostream& out);

// The heights of a level, [0, max_level], as a 16-bit grey PNG: docs/displacement-atlas.md.
absl::Status WriteDisplacementAtlas(const DisplacedSurface& surface, int level,
                                    const RunContext& context, std::ostream& out);

}  // namespace rilievo
