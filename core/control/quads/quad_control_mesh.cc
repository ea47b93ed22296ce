#include "core/control/quads/quad_control_mesh.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/status_macros.h"
#include "core/control/quads/improve_quads.h"
#include "core/control/quads/pair_triangles.h"
#include "core/control/quads/polygon_set.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

// Each triangle in three quads around its middle.
ControlMesh InThrees(const ControlMesh& mesh, const MeshTopology& topology,
                     const CreaseTopology& creases) {
  const int first_middle = topology.vertex_count;
  const int first_center = first_middle + topology.edge_count();
  ControlMesh made;
  made.vertices.resize(3, first_center + topology.face_count());
  made.vertices.leftCols(first_middle) = mesh.vertices;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const auto ends = topology.edge_vertices.col(e);
    made.vertices.col(first_middle + e) =
        0.5 * (mesh.vertices.col(ends[0]) + mesh.vertices.col(ends[1]));
  }
  made.faces.resize(3, 6 * static_cast<Eigen::Index>(topology.face_count()));
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto corners = topology.faces.col(f), sides = topology.face_edges.col(f);
    const int center = first_center + f;
    made.vertices.col(center) = (mesh.vertices.col(corners[0]) + mesh.vertices.col(corners[1]) +
                                 mesh.vertices.col(corners[2])) /
                                3;
    for (int k = 0; k < 3; ++k) {
      const int after = first_middle + sides[k], before = first_middle + sides[kPreviousCorner[k]];
      made.faces.col(6 * Eigen::Index{f} + 2 * k) << corners[k], after, center;
      made.faces.col(6 * Eigen::Index{f} + 2 * k + 1) << corners[k], center, before;
      made.diagonals.push_back({corners[k], center});
    }
  }
  for (const SharpEdge& sharp : creases.edges) {
    for (int end = 0; end < 2; ++end) {
      made.creases.push_back(
          {topology.edge_vertices(end, sharp.edge), first_middle + sharp.edge, sharp.sharpness});
    }
  }
  made.corners = mesh.corners;
  SortTags(&made.creases, &made.corners);
  std::sort(made.diagonals.begin(), made.diagonals.end());
  return made;
}

}  // namespace

absl::StatusOr<ControlMesh> QuadControlMesh(const ControlMesh& mesh) {
  if (mesh.quads()) return absl::InvalidArgumentError("the control mesh has quads already");
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(mesh, topology));
  PolygonSet polygons(mesh);
  if (PairTriangles(&polygons)) {
    ImproveQuads(&polygons);
    if (std::optional<ControlMesh> made = polygons.ToControlMesh(mesh.corners)) {
      return *std::move(made);
    }
  }
  return InThrees(mesh, topology, creases);
}

}  // namespace rilievo
