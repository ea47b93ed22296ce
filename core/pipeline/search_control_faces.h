// How many control faces serve an asked error or size best.
#pragma once

#include "core/control/build_control_mesh.h"
#include "core/pipeline/code_surface.h"

namespace rilievo {

// Codes the surface over the mesh of `start` and over coarser meshes of the same topology, each of
// 0.4 times the faces of the one before, and keeps the best one: of those within encode.max_error
// the one of the fewest bytes; for encode.max_bytes that of the least error. The bytes are taken to
// have one minimum: from the second mesh the search goes the way in which they fall, and then tries
// half a step to either side of the best, and of machined parts (IsMachined) a quarter too. A given
// mesh of few triangles is one more (DomainOfMesh). A trial
// costs the fit, the heights, their measure and the codec, a third to half of a whole
// reconstruction. The best one is decoded and measured, and coded again more finely or more
// coarsely until the error asked for is kept (KeepError). Where it cannot be, though noise allows
// it, meshes of more faces are tried in the same way; if none keeps it, the most exact of these
// stays.
// `mesh`: see CodeSurface().
absl::StatusOr<CodedSurface> SearchControlFaces(const ScanSurface& scan, const Shape& mesh,
                                                const ControlMeshResult& start,
                                                const DssMetadata& metadata,
                                                const ReconstructOptions& options,
                                                const PipelineContext& context);

}  // namespace rilievo
