// The quads over which a subdivision surface is cut into patches.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A place on a control face, by the weights of its corners, which sum to 1.
struct FacePlace {
  int face = 0;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
};

// A side of patches, straight within a face of the control mesh.
struct DomainEdge {
  int from = 0, to = 0;  // vertices
  int face = 0;
  Eigen::Vector3d begin, end;  // weights
  FacePlace At(double t) const { return {face, (1 - t) * begin + t * end}; }
};

// Counter-clockwise; corners 0 to 3 lie at (s, t) = (0, 0), (1, 0), (1, 1) and (0, 1), and edge i
// joins corner i and the one after.
struct DomainPatch {
  std::array<int, 4> edges;
  std::array<bool, 4> forward;  // whether the edge runs from corner i to the one after
  // The faces that hold corners 0, 1, 2 and corners 0, 2, 3: the halves of a quad, or the same one.
  std::array<int, 2> faces;
  std::array<Eigen::Vector3d, 3> first, second;  // weights of these corners there
  // [0, 1] each. Bilinear within one face, else linear within each half.
  FacePlace At(double s, double t) const;
};

// A closed or open manifold of quads. Each quad of a Catmull-Clark control mesh is one; a face of a
// Loop control mesh is three, around its middle.
struct PatchDomains {
  int vertex_count = 0;
  std::vector<DomainEdge> edges;
  std::vector<DomainPatch> patches;
};

// INVALID_ARGUMENT as BuildMeshTopology() and FlagsOfDiagonals().
absl::StatusOr<PatchDomains> DomainsOf(const ControlMesh& mesh);

}  // namespace rilievo
