// From an iso-surface of 10^5 faces to a control mesh of 10^3.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct SimplifyOptions {
  int target_faces = 2000;           // per whole mesh, >= 4 a component
  double max_normal_turn_degrees = 80;  // no collapse turns a face further than this in all
  int max_valence = 9;               // no collapse makes a larger one
  absl::Status Validate() const;
};

// Quadric edge collapse (Garland and Heckbert 1997) that keeps topology (link condition), boundary
// and components. `mesh`: an orientable 2-manifold. Result: the same topology, faces near the target.
absl::StatusOr<ControlMesh> SimplifyMesh(const ControlMesh& mesh, const SimplifyOptions& options,
                                         const RunContext& context);

// Edge flips towards valence 6 (4 on the boundary) where the shape allows: normals of the two faces
// within `max_dihedral_degrees`, no fold, no doubled edge.
void ImproveValence(ControlMesh* mesh, double max_dihedral_degrees);

}  // namespace rilievo
