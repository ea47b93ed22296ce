// The smooth surface: how many control faces it takes, and its fit to the points.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "core/domain/fit_loop_domain.h"
#include "core/geometry/triangle_mesh.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

struct Domain {
  DomainFit fit;
  // Of the control-point quantiser: heights are sampled over the mesh rounded to it, and so take up
  // the rounding.
  double position_step = 0;
  bool is_filled =
      false;              // see FillByArcs(): then the step is at most kFitDomain.step_where_filled
  bool is_given = false;  // see DomainOfMesh(): then finer levels are only made where asked for
  bool has_exact_border = false;  // see BoundaryRule::kExact: then heights on borders are zero
  double border_miss = 0;         // the farthest that such a border is off, with its rounding
};

// See EncodeOptions: those that an exact border needs past the step; else 0.
int BorderDigitsOf(const Domain& domain);

// Whether the mesh has enough creases for a machined part: more than one edge in 50.
bool IsMachined(const ControlMesh& mesh);

// Step of the control-point quantiser for a fitted control mesh in the unit frame, in [4e-4, 5e-3].
// On a smooth surface, where every region has heights anyway, a tenth of its short edges will do:
// an owl of 500 control faces took 1 882 bytes at 3e-3 and 2 131 at 4e-4 for the same error. A
// machined part has flat faces that need no heights while the rounding stays below the coding
// error: there at most four times `coding_error`, fraction of the diagonal; unset: not known yet,
// and kPositionStep.
double PositionStepFor(const ControlMesh& mesh, std::optional<double> coding_error);

// The Loop surface of `start`, fitted to the points. Its position step is encode.position_step, or
// that of PositionStepFor() where none was asked for; over known sharp lines at most 1e-4, or the
// error asked for: a cylinder united with an ellipsoid came to 0.16 % at 4e-4 and 0.035 % at 1e-4.
absl::StatusOr<Domain> FitDomain(const ScanSurface& scan, const ControlMesh& start,
                                 const ReconstructOptions& options, const PipelineContext& context);

// `start`, as BuildControlMesh() made it of the scan, with about `target_faces` faces. Machined
// parts carry their creases along. What few creases another shape has are found anew in the points
// instead, unless the mesh they are of is known: on faces that long most are bends that need none,
// and would cost more than they give (spot at 0.03 %: 13 % of the bytes). Errors: those of
// CoarserControlMesh().
absl::StatusOr<ControlMesh> FewerFaces(const ScanSurface& scan, const ControlMesh& start,
                                       int target_faces, const RunContext& context);

// The domain over a fifth of the faces of `start` where it serves as well, else over `start`. So it
// does where the points are noisy, and about as far from it as their noise alone puts them: that
// takes a third of the bytes away from smooth objects and a plain machined part of 100 000 points
// with a noise of 0.1 % of the diagonal; objects of thin walls or much detail keep their faces. And
// over a mesh of fewer triangles than control faces, while its flat faces are the domain's and this
// comes to all of the mesh, a fifth of these and so on: a cube takes 30 faces and 210 bytes instead
// of 3 332 and 4 792. Where that takes more faces than the mesh has triangles, these are the domain
// (DomainOfMesh): a prism of 64 sides takes 639 bytes instead of 19 908. Clean scans keep their
// faces: there the finest heights take the bytes.
// `spacing`: the median of all points, of which `scan` may hold some. `mesh`: that the points lie
// on, unit frame; without triangles: they are scanned. Errors: those of FewerFaces() and
// FitDomain().
absl::StatusOr<Domain> FitFewFaces(const ScanSurface& scan, double spacing, const Shape& mesh,
                                   const ControlMesh& start, const ReconstructOptions& options,
                                   const PipelineContext& context);

// The domain that a given mesh of few triangles is itself; unset where ControlMeshOfFewTriangles()
// is, or where the options ask for quads, for no creases, or for holes and gaps to be closed.
std::optional<Domain> DomainOfMesh(const ScanSurface& scan, const Shape& mesh, int64_t faces,
                                   const ReconstructOptions& options);

}  // namespace rilievo
