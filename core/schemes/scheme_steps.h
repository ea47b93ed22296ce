// One step of each scheme.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/polygon_mesh.h"
#include "core/geometry/triangle_mesh.h"
#include "core/schemes/polygon_topology.h"

namespace rilievo {

// New face point: the mean of the corners. New edge point: the mean of the ends and of the face
// points beside it. Vertex of valence n: (Q + 2 R + (n - 3) v) / n, with Q the mean of the face
// points and R of the middles of the edges around. On the border the cubic B-spline: 1/2 1/2; 1/8
// 3/4 1/8.
PolygonMesh CatmullClarkStep(const PolygonMesh& mesh, const PolygonTopology& topology);

// Corner i of a face of n has a point of its own: (n + 5) / 4 n of itself and (3 + 2 cos(2 pi (i -
// j) / n)) / 4 n of corner j. Faces of faces, edges and vertices. On the border Chaikin's corners
// (3/4 1/4), which the faces of its edges and vertices reach, so that the surface ends there.
PolygonMesh DooSabinStep(const PolygonMesh& mesh, const PolygonTopology& topology);

// The vertices after those given, one an edge of `topology`. Regular: 1/2 of the ends, 1/8 of the
// corners opposite, -1/16 of the four wings. Beside an interior vertex of valence k other than 6:
// 3/4 of it, and of its j-th neighbour (1/4 + cos(2 pi j / k) + cos(4 pi j / k) / 2) / k, with
// tables for k of 3 and 4; the mean of both ends' where both are irregular. A wing beyond the
// border is its triangle's third corner, reflected: a + b - c. Border: -1/16 9/16 9/16 -1/16.
Eigen::Matrix3Xd ButterflyPoints(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices);

// New vertex in the middle of each face, all interior edges flipped; vertex of valence n: 1 - alpha
// of itself, alpha / n of each neighbour, alpha = (4 - 2 cos(2 pi / n)) / 9. Where `split_border`
// faces on the border get two vertices on their edge of it instead, with the weights 10 16 1, 4 19
// 4 and 1 16 10 (of 27) along the border; such a face has one edge there. Else the border stays.
TriangleMesh Sqrt3Step(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices,
                       bool split_border);

}  // namespace rilievo
