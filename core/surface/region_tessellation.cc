#include "core/surface/region_tessellation.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/loop/crease_topology.h"
#include "core/loop/face_vertices.h"
#include "core/loop/quad_topology.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

absl::Status CheckRegion(const DisplacedSurface& surface, std::span<const int> faces, int level) {
  if (surface.max_level < 0 || surface.max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level is ", surface.max_level, ", must be 0 to ", kMaxLoopLevel));
  }
  if (level < 0 || level > surface.max_level) {
    return absl::InvalidArgumentError(absl::StrCat(
        "level is ", level, ", regions of this surface have 0 to ", surface.max_level));
  }
  const int count = static_cast<int>(surface.control_mesh.faces.cols());
  for (size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] < 0 || faces[i] >= count || (i > 0 && faces[i] <= faces[i - 1])) {
      return absl::InvalidArgumentError(absl::StrCat("control face ", faces[i], " at place ", i,
                                                     ": they must ascend and lie within 0 to ",
                                                     count - 1));
    }
  }
  if (surface.control_mesh.faces.cols() > kMaxLoopFaces >> (2 * surface.max_level)) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "level ", surface.max_level, " would have more than ", kMaxLoopFaces, " faces"));
  }
  return absl::OkStatus();
}

// The wanted triangles of a mesh of the part, over the vertices they use in the whole's order.
RegionMesh Trim(const TriangleMesh& part, const std::vector<uint8_t>& wanted,
                const std::vector<int>& whole_vertex) {
  const Eigen::Index per_face = part.triangles.cols() / static_cast<Eigen::Index>(wanted.size());
  std::vector<int> kept;  // vertices of the part
  std::vector<int> number(part.vertices.cols(), -1);
  Eigen::Index triangles = 0;
  for (size_t f = 0; f < wanted.size(); ++f) {
    if (wanted[f] == 0) continue;
    const auto face = part.triangles.middleCols(static_cast<Eigen::Index>(f) * per_face, per_face);
    for (const auto triangle : face.colwise()) {
      for (int v : triangle) {
        if (number[v] < 0) kept.push_back(v);
        number[v] = 0;
      }
    }
    triangles += per_face;
  }
  std::sort(kept.begin(), kept.end(),
            [&](int a, int b) { return whole_vertex[a] < whole_vertex[b]; });
  RegionMesh region;
  region.mesh.vertices.resize(3, static_cast<Eigen::Index>(kept.size()));
  region.mesh.normals.resize(3, region.mesh.vertices.cols());
  for (size_t i = 0; i < kept.size(); ++i) {
    number[kept[i]] = static_cast<int>(i);
    region.mesh.vertices.col(static_cast<Eigen::Index>(i)) = part.vertices.col(kept[i]);
    region.mesh.normals.col(static_cast<Eigen::Index>(i)) = part.normals.col(kept[i]);
    region.vertices.push_back(whole_vertex[kept[i]]);
  }
  region.mesh.triangles.resize(3, triangles);
  Eigen::Index at = 0;
  for (Eigen::Index t = 0; t < part.triangles.cols(); ++t) {
    if (wanted[static_cast<size_t>(t / per_face)] == 0) continue;
    for (int k = 0; k < 3; ++k) region.mesh.triangles(k, at) = number[part.triangles(k, t)];
    ++at;
  }
  return region;
}

}  // namespace

absl::StatusOr<RegionMesh> TessellateRegion(const DisplacedSurface& surface,
                                            std::span<const int> control_faces, int level,
                                            const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckRegion(surface, control_faces, level));
  if (control_faces.empty()) return RegionMesh();
  const ControlMesh& whole = surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(whole.faces, static_cast<int>(whole.vertices.cols())));
  const FaceVertices whole_heights(topology, surface.max_level);
  if (static_cast<int64_t>(surface.heights.size()) != whole_heights.count()) {
    return absl::InvalidArgumentError(absl::StrCat("heights has ", surface.heights.size(),
                                                   " entries, level ", surface.max_level, " has ",
                                                   whole_heights.count(), " vertices"));
  }
  std::vector<SharpEdge> sharp;
  if (!whole.creases.empty() || !whole.corners.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(CreaseTopology creases, BuildCreaseTopology(whole, topology));
    sharp = std::move(creases.edges);
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> diagonal, FlagsOfDiagonals(whole, topology));
  std::vector<uint8_t> wanted(whole.faces.cols(), 0);
  for (int f : control_faces) wanted[f] = 1;
  // Normals on the border of the part take the faces that touch it, whose points have to be right.
  SubMesh sub = CutFacesOut(topology, whole.vertices, WithTouchingFaces(topology, wanted), sharp,
                            whole.corners, diagonal);

  DisplacedSurface part;
  part.frame = surface.frame;
  part.control_mesh = std::move(sub.mesh);
  part.max_level = level;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology part_topology,
                           BuildMeshTopology(part.control_mesh.faces,
                                             static_cast<int>(part.control_mesh.vertices.cols())));
  const FaceVertices whole_vertices(topology, level), part_vertices(part_topology, level);
  part.heights.resize(part_vertices.count());
  part.sources.resize(part_vertices.count(), HeightSource::kMeasured);
  std::vector<int> whole_vertex(part_vertices.count());
  std::vector<uint8_t> wanted_part;
  std::vector<int> from, to;
  for (size_t f = 0; f < sub.faces.size(); ++f) {
    whole_vertices.Of(sub.faces[f], from);
    part_vertices.Of(static_cast<int>(f), to);
    for (size_t p = 0; p < to.size(); ++p) {
      whole_vertex[to[p]] = from[p];
      part.heights[to[p]] = surface.heights[from[p]];
    }
    wanted_part.push_back(wanted[sub.faces[f]]);
  }
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh, Tessellate(part, level, context));
  return Trim(mesh, wanted_part, whole_vertex);
}

}  // namespace rilievo
