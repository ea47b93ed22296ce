// A decoded surface with another control mesh of the same faces: its heights ride along.
#pragma once

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// The surface with the control points and the tags of `cage` (scan frame) in the place of its own.
// Heights, sources and colours stay as they are, since heights stand along the limit normals of
// whatever smooth surface there is (Lee, Moreton and Hoppe 2000, section 6, "animation"). The frame
// stays, so that heights keep their size; control points are not rounded, sharpness is, to 1/16.
// What the metadata say of the scan (errors, folds, number and hash of the points) goes, and the
// chunks are none.
//
// INVALID_ARGUMENT when vertices or faces of `cage` are not those of the surface (in any order of
// the faces), a tag is not an edge or vertex of it, or a coordinate is not finite or beyond 1e6
// diagonals.
absl::StatusOr<DecodedSurface> WithControlMesh(const DecodedSurface& decoded,
                                               const ControlMesh& cage);

// A cage (scan frame) as the control mesh of a surface in `frame`, its faces those of `own` in
// their order, its tags ascending, each once. The errors of WithControlMesh, but tags are not held
// against the faces.
absl::StatusOr<ControlMesh> ControlMeshOfCage(const ControlMesh& cage, const SpatialFrame& frame,
                                              const Eigen::Matrix3Xi& own);

// `moved` with the vertices of `own` where they differ by no more than an editor's numbers: the
// digits lost in text, or 32-bit floats. Scan frame; those of another number of vertices stay.
Eigen::Matrix3Xd WithoutRounding(const Eigen::Matrix3Xd& moved, const Eigen::Matrix3Xd& own,
                                 double diagonal);

// Without what is true of the shape that was scanned alone.
DssMetadata OfAnotherShape(const DssMetadata& metadata);

}  // namespace rilievo
