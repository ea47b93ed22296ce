// Triangle meshes as plain values: the tessellated result, and the control mesh of a surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace rilievo {

// Triangles are counter-clockwise seen from outside; indices are columns of `vertices`.
struct TriangleMesh {
  Eigen::Matrix3Xd vertices;   // column = position
  Eigen::Matrix3Xi triangles;  // column = vertex indices
  Eigen::Matrix3Xd normals;    // column = unit normal of the vertex; empty, or one per vertex
};

// Sharpness at and above which a crease stays sharp at every level; below it a crease is
// semi-sharp: it loses 1 a level, and is smooth in the limit (DeRose, Kass, Truong 1998; the value
// is OpenSubdiv's).
inline constexpr float kInfiniteSharpness = 10.0f;

// A tagged edge of a control mesh.
struct Crease {
  int a = 0, b = 0;                      // its ends, a < b
  float sharpness = kInfiniteSharpness;  // positive, infinity allowed
  friend bool operator==(const Crease&, const Crease&) = default;
};

// The control mesh of a Loop or Catmull-Clark surface, unit frame. An orientable 2-manifold, with
// or without boundary, of one or more components, every vertex used (see mesh_topology.h). What the
// tags make of a vertex: crease_topology.h in core/loop. A boundary edge is always sharp, tagged or
// not.
struct ControlMesh {
  Eigen::Matrix3Xd vertices;         // column = control point
  Eigen::Matrix3Xi faces;            // column = vertex indices, counter-clockwise seen from outside
  std::vector<Crease> creases = {};  // edges of the mesh, ascending (a, b), each once
  std::vector<int> corners = {};     // vertices that stay where they are, ascending, each once
  // Edges (a, b), a < b, ascending, each once, that cut a quad into two triangles, so that each
  // face is half of one quad. The surface is then the Catmull-Clark surface of the quads
  // (quad_masks.h in core/loop); without diagonals it is the Loop surface of the triangles.
  std::vector<std::array<int, 2>> diagonals = {};
  bool quads() const { return !diagonals.empty(); }
};

}  // namespace rilievo
