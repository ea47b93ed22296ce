// Some faces of a mesh, with all that their limit surface depends on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

struct SubMesh {
  ControlMesh mesh;        // a manifold whenever the whole mesh is one
  std::vector<int> faces;  // of the whole mesh, ascending: face i of `mesh` is faces[i] there
};

// The wanted faces and those that touch them. On the wanted ones the limit surface is that of the
// whole mesh; corner k of a face stays its corner k. Where the faces taken touch in a vertex only,
// that vertex is there once for each fan. `sharp`: sharp edges of the topology, ascending;
// `corners`: its corner vertices. `diagonal`: of quads, by edge (FlagsOfDiagonals): then whole
// quads are taken, and those that touch them.
SubMesh CutFacesOut(const MeshTopology& topology, const Eigen::Matrix3Xd& points,
                    const std::vector<uint8_t>& wanted, const std::vector<SharpEdge>& sharp,
                    const std::vector<int>& corners, const std::vector<uint8_t>& diagonal = {});

// The connectivity of some faces alone.
struct FaceCut {
  Eigen::Matrix3Xi faces;      // a manifold whenever the whole mesh is one
  std::vector<int> vertex_of;  // of the whole mesh, each vertex here; one of several fans repeats
};
// Vertices are numbered in the order in which the faces meet them. `part`: a number for each face
// of the topology, that of `faces` their own and no other face's; `place`: where each is in
// `faces`.
FaceCut CutConnectivity(const MeshTopology& topology, const std::vector<int>& faces,
                        const std::vector<int>& part, const std::vector<int>& place);

// The marked faces and those that touch them.
std::vector<uint8_t> WithTouchingFaces(const MeshTopology& topology,
                                       const std::vector<uint8_t>& marked);

}  // namespace rilievo
