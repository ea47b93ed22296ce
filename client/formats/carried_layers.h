// Colours and intensity of a scan on the vertices of its surface.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "client/formats/scan_reader.h"
#include "core/base/run_context.h"

namespace rilievo {

// For each vertex the values of the scan's point nearest to it, of the points with finite
// coordinates; the first of equally near ones may be any of them, the same each time. Columns in
// the same frame. INVALID_ARGUMENT when the scan has no layer or no such point.
absl::StatusOr<PointLayers> LayersAt(const Eigen::Matrix3Xd& vertices, const ScanFile& scan,
                                     const RunContext& context);

}  // namespace rilievo
