// Parts of a mesh, and meshes that are not manifold until their vertices are split.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/disjoint_sets.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A part of a mesh that knows which vertices it came from.
struct MeshSubset {
  ControlMesh mesh;
  std::vector<int> source_vertex;
};

// Gives each fan of faces around a vertex a vertex of its own and drops unused vertices.
MeshSubset SplitFans(const ControlMesh& mesh);

// Of vertices that faces join. Pieces that meet at a vertex are one unless their fans were split.
DisjointSets JoinedVertices(const Eigen::Matrix3Xi& faces, int vertex_count);

// The faces whose flag is 1, with their fans split, their creases, corners and diagonals.
MeshSubset KeepFaces(const ControlMesh& mesh, const std::vector<uint8_t>& keep_face);

}  // namespace rilievo
