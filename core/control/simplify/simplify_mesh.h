// From an iso-surface of 10^5 faces to a control mesh of 10^3.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify/settings.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct SimplifyOptions {
  // Faces of the whole mesh, [4, inf). No closed component is taken below 20 faces, no open one
  // below 8, so a mesh of many components may keep more.
  int target_faces = 2000;
  // No collapse turns a face further than this in all, counted from the input. (0, 90].
  double max_normal_turn_degrees = 80;
  // No collapse makes a larger one, but for the early ones, which may by up to 3. [6, 32].
  int max_valence = 9;
  // Weight of the spread of the input area that a vertex stands for, against its squared distance
  // to the planes: higher gives evener, rounder faces, lower follows curvature more. [1e-6, 1].
  double evenness = 0.01;
  // Weight of the boundary's shape against the surface's. [0, 1000].
  double boundary_weight = 1.0;
  // Down to so many times the target it matters little which vertex goes first, and large meshes go
  // block by block. [1, inf).
  double unordered_until = 8.0;
};

// What the faces of a mesh stand for. Without normals: their own planes.
struct FacePlanes {
  Eigen::Matrix3Xd normals;  // column = unit normal of a face's plane, zero for none
  Eigen::Matrix3Xd points;   // column = a point on it
  // How many times its area a face counts; empty: once.
  std::vector<float> weights = {};
};

// Quadric edge collapse (Garland and Heckbert 1997), vertices placed at the least error, that keeps
// topology (link condition), boundary loops and components, and creases: these shorten edge by edge
// between their ends, and not where they would come to turn sharply, for their limit is smooth;
// their other vertices slide along them. The tags of `mesh` are edges of it. `mesh`: an orientable
// 2-manifold. Result: the same topology, creases and corners, faces at the target or, where the
// guards forbid every collapse, above. `planes`, where given, are those the quadrics are made of,
// instead of the faces' own, and say how much each counts. Large meshes collapse block by block on
// all threads first, with the same result for any number of them. INVALID_ARGUMENT for a mesh that
// is not one, or is not finite. Measured on two cores, to 3000 faces: 0.09 s from 100k faces, 0.28
// s from 300k.
absl::StatusOr<ControlMesh> SimplifyMesh(ControlMesh mesh, const SimplifyOptions& options,
                                         const RunContext& context,
                                         const FacePlanes* planes = nullptr);

// Edge flips towards valence 6 (4 on the boundary) where the shape allows: normals of the two faces
// within `max_dihedral_degrees`, no fold, no doubled edge. Creases stay.
void ImproveValence(ControlMesh* mesh,
                    double max_dihedral_degrees = kSimplifyMesh.flat_dihedral_degrees);

}  // namespace rilievo
