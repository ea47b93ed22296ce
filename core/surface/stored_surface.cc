#include "core/surface/stored_surface.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "core/loop/quad_topology.h"

namespace rilievo {

int64_t VertexCountAt(const MeshTopology& control, int level) {
  int64_t vertices = control.vertex_count, edges = control.edge_count();
  int64_t faces = control.face_count();
  for (int step = 0; step < level; ++step) {
    vertices += edges;
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  return vertices;
}

absl::StatusOr<PartCutter> PartCutter::Make(const ControlMesh& mesh) {
  RILIEVO_ASSIGN_OR_RETURN(MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  return Make(mesh, std::move(topology));
}

absl::StatusOr<PartCutter> PartCutter::Make(const ControlMesh& mesh, MeshTopology topology) {
  PartCutter cutter(mesh, std::move(topology));
  if (!mesh.creases.empty() || !mesh.corners.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(CreaseTopology creases, BuildCreaseTopology(mesh, cutter.topology_));
    cutter.sharp_ = std::move(creases.edges);
  }
  RILIEVO_ASSIGN_OR_RETURN(cutter.diagonal_, FlagsOfDiagonals(mesh, cutter.topology_));
  return cutter;
}

SubMesh PartCutter::Cut(std::span<const int> faces, int rings) const {
  std::vector<uint8_t> wanted(topology_.face_count(), 0);
  for (const int f : faces) wanted[f] = 1;
  for (int ring = 0; ring < rings; ++ring) wanted = WithTouchingFaces(topology_, wanted);
  return CutFacesOut(topology_, mesh_.vertices, wanted, sharp_, mesh_.corners, diagonal_);
}

std::vector<int> PlacesOf(std::span<const int> wanted, const std::vector<int>& faces) {
  std::vector<int> places;
  for (const int f : wanted) {
    const auto at = std::lower_bound(faces.begin(), faces.end(), f);
    places.push_back(static_cast<int>(at - faces.begin()));
  }
  return places;
}

absl::StatusOr<SurfacePart> ReadPart(const StoredSurface& surface, const PartCutter& cutter,
                                     std::span<const int> faces, int rings) {
  SubMesh sub = cutter.Cut(faces, rings);
  SurfacePart part;
  part.surface.frame = surface.frame;
  part.surface.max_level = surface.max_level;
  RILIEVO_ASSIGN_OR_RETURN(
      const MeshTopology topology,
      BuildMeshTopology(sub.mesh.faces, static_cast<int>(sub.mesh.vertices.cols())));
  RILIEVO_RETURN_IF_ERROR(surface.heights->Read(sub.faces,
                                                FaceVertices(topology, surface.max_level),
                                                &part.surface.heights, &part.surface.sources));
  part.surface.control_mesh = std::move(sub.mesh);
  part.faces = std::move(sub.faces);
  part.inner = PlacesOf(faces, part.faces);
  return part;
}

}  // namespace rilievo
