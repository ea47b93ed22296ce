// Triangle meshes as plain values: the tessellated result, and the control mesh of a Loop surface.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Triangles are counter-clockwise seen from outside; indices are columns of `vertices`.
struct TriangleMesh {
  Eigen::Matrix3Xd vertices;   // column = position
  Eigen::Matrix3Xi triangles;  // column = vertex indices
  Eigen::Matrix3Xd normals;    // column = unit normal of the vertex; empty, or one per vertex
};

// The control mesh of a Loop surface, unit frame. An orientable 2-manifold, with or without
// boundary, of one or more components, every vertex used (see mesh_topology.h).
struct ControlMesh {
  Eigen::Matrix3Xd vertices;  // column = control point
  Eigen::Matrix3Xi faces;     // column = vertex indices, counter-clockwise seen from outside
};

}  // namespace rilievo
