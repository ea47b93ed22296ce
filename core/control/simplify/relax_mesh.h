// Rounds a control mesh's faces by sliding its vertices along the surface.
#pragma once

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

class HalfEdgeMesh;

// Whether no face around `vertex` of `mesh`, whose half-edges are given, turns over when it moves.
bool KeepsFacesUpright(const ControlMesh& mesh, const HalfEdgeMesh& half_edges, int vertex,
                       const Eigen::Vector3d& moved);

// `rounds` of Laplacian smoothing in the tangent plane: each vertex moves to the place of the least
//   sum over its faces of area (n . (x - v))^2 + weight * area |x - g|^2,
// where the planes (n, v) are those of the mesh as it was given, boundary edges adding upright
// planes of their own, and g is the mean of the neighbours (boundary vertices: of their two
// boundary neighbours; vertices of a tagged crease: of their two on it, and where it ends or meets
// another, and at corners, they stay). On flat parts that is g, on a crease the slide along the
// crease, at a corner next to nothing, however many the rounds. No face turns over. Vertices keep
// their order.
void RelaxTangentially(ControlMesh* mesh, int rounds);

// Flips towards valence 6 across edges flatter than 40 degrees and relaxation, in turn: the last
// of every simplification that makes a control mesh.
void ImproveShape(ControlMesh* mesh);

}  // namespace rilievo
