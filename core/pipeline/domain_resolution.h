// How many control faces a scan needs, and control meshes of fewer.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify/uncovered_points.h"
#include "core/geometry/triangle_mesh.h"
#include "core/pipeline/build_surface.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// `start`, as BuildControlMesh() made it of the scan, with about `target_faces` faces. Machined
// parts carry their creases along. What few creases another shape has are found anew in the points
// instead: on faces that long most are bends that need none, and would cost more than they give
// (spot at 0.03 %: 13 % of the bytes). `lost` and errors: those of CoarserControlMesh().
absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context,
                                       const UncoveredPoints& lost = {});

// The domain over a fifth of the faces of `start`, and more where points would be out of its reach
// (core/control/simplify/uncovered_points.h), if the scan is noisy and its points lie about as far
// from that domain as their noise alone puts them; else over `start`. Before there were more, that
// took a third of the bytes away from smooth objects and a plain machined part of 100 000 points
// with a noise of 0.1 % of the diagonal, RMS errors to the truth differed by 1 %; objects of thin
// walls or much detail keep their faces. Clean scans do: there the finest heights take the bytes.
absl::StatusOr<Domain> FitUnderNoise(const ScanSurface& scan, const ControlMesh& start,
                                     const ReconstructOptions& options, const RunContext& context,
                                     ReconstructReport* report);

}  // namespace rilievo
