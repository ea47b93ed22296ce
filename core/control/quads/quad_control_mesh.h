// A control mesh of quads from one of triangles.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// The same surface in quads (ControlMesh::diagonals), with the same pieces, genus and boundary
// loops, creases and corners. Its vertices are those of `mesh`, and one in the middle of each edge
// of the boundary or of a crease at which the triangles on one side are odd in number
// (pair_triangles.h); a few inside may go (improve_quads.h). A component that cannot be paired, as
// one of few triangles full of creases may not, gets three quads for each triangle; the others do
// not. INVALID_ARGUMENT unless `mesh` is a manifold of triangles.
absl::StatusOr<ControlMesh> QuadControlMesh(const ControlMesh& mesh);

// Replaces the values of the two halves of each quad in `*of_face`, one entry per face, by their
// mean.
void ShareBetweenHalves(const ControlMesh& quads, std::vector<float>* of_face);

}  // namespace rilievo
