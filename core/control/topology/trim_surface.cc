#include "core/control/topology/trim_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/topology/mesh_subset.h"
#include "core/control/topology/settings.h"
#include "core/control/topology/surface_support.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

// Where the border goes on from each vertex; -1 off it.
std::vector<int> NextOnBorder(const ControlMesh& mesh) {
  std::vector<int> next(mesh.vertices.cols(), -1);
  ForEachEdge(mesh.faces, static_cast<int>(next.size()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                if (group.size() > 1) return;
                const int from = Origin(mesh.faces, group[0]);
                next[from] = low + high - from;
              });
  return next;
}

bool AllOf(const std::vector<uint8_t>& flags) {
  return std::find(flags.begin(), flags.end(), 0) == flags.end();
}

// Drops connected pieces whose supported area holds fewer points than kTrimSurface.fewest_of_piece,
// a point on each squared spacing; the largest only where it is a scrap. `mesh`: no vertex unused,
// and each fan with a vertex of its own.
MeshSubset DropSmallPieces(ControlMesh mesh, const SurfaceSupport& support,
                           double share_of_spacing) {
  DisjointSets pieces = JoinedVertices(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  std::vector<double> points(static_cast<size_t>(mesh.vertices.cols()), 0);
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const auto corners = mesh.faces.col(f);
    if (!support.holds[corners[0]] || !support.holds[corners[1]] || !support.holds[corners[2]]) {
      continue;
    }
    const Eigen::Vector3d a = mesh.vertices.col(corners[0]);
    const Eigen::Vector3d b = mesh.vertices.col(corners[1]) - a;
    const Eigen::Vector3d c = mesh.vertices.col(corners[2]) - a;
    const double spacing = support.spacing[corners[0]];
    points[pieces.Find(corners[0])] += b.cross(c).norm() / 2 / (spacing * spacing);
  }
  const double most = points.empty() ? 0 : *std::max_element(points.begin(), points.end());
  const double fewest = kTrimSurface.fewest_of_piece * share_of_spacing * share_of_spacing;
  const double least = std::max(std::min(fewest, most), kTrimSurface.least_of_all);
  std::vector<uint8_t> keep(mesh.faces.cols());
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    keep[f] = points[pieces.Find(mesh.faces(0, f))] >= least;
  }
  if (!AllOf(keep)) return KeepFaces(mesh, keep);
  MeshSubset all{std::move(mesh), {}};
  all.source_vertex.resize(all.mesh.vertices.cols());
  std::iota(all.source_vertex.begin(), all.source_vertex.end(), 0);
  return all;
}

// What stays of the surface of an open scan: supported vertices and small holes.
std::vector<uint8_t> VerticesToKeep(const ControlMesh& surface,
                                    const std::vector<int>& next_on_border,
                                    const SurfaceSupport& support) {
  // Connected vertices without support.
  struct Hole {
    Eigen::AlignedBox3d box;
    double spacing = 0;  // sum over its vertices
    int vertices = 0;
    bool touches_border = false;
  };
  DisjointSets connected(support.holds.size());
  for (const auto face : surface.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      const int a = face[k], b = face[kNextCorner[k]];
      if (support.holds[a] == 0 && support.holds[b] == 0) connected.Unite(a, b);
    }
  }
  std::unordered_map<uint32_t, Hole> holes;
  const auto vertex_count = static_cast<int>(support.holds.size());
  for (int v = 0; v < vertex_count; ++v) {
    if (support.holds[v] != 0) continue;
    Hole& hole = holes[connected.Find(v)];
    hole.box.extend(surface.vertices.col(v));
    hole.spacing += support.spacing[v];
    ++hole.vertices;
    hole.touches_border = hole.touches_border || next_on_border[v] >= 0;
  }
  std::vector<uint8_t> keep = support.holds;
  for (int v = 0; v < vertex_count; ++v) {
    if (support.holds[v] != 0) continue;
    const Hole& hole = holes[connected.Find(v)];
    const double spacing = hole.spacing / hole.vertices;
    keep[v] = !hole.touches_border &&
              hole.box.diagonal().norm() <= kSurfaceSupport.filled_hole_spacings * spacing;
  }
  return keep;
}

// Moves the vertices of the border along the mean of their two neighbours on it.
void SmoothBorder(const std::vector<int>& next_on_border, int rounds, ControlMesh* mesh) {
  std::vector<int> on_border, before(next_on_border.size(), -1);
  for (int v = 0; v < static_cast<int>(next_on_border.size()); ++v) {
    if (next_on_border[v] < 0) continue;
    on_border.push_back(v);
    before[next_on_border[v]] = v;
  }
  Eigen::Matrix3Xd moved(3, on_border.size());
  for (int round = 0; round < rounds; ++round) {
    for (size_t i = 0; i < on_border.size(); ++i) {
      const int v = on_border[i];
      moved.col(i) = 0.5 * mesh->vertices.col(v) +
                     0.25 * (mesh->vertices.col(next_on_border[v]) + mesh->vertices.col(before[v]));
    }
    for (size_t i = 0; i < on_border.size(); ++i) mesh->vertices.col(on_border[i]) = moved.col(i);
  }
}

SurfaceSupport Inherit(const SurfaceSupport& support, const std::vector<int>& source_vertex) {
  SurfaceSupport part;
  for (const int v : source_vertex) {
    part.holds.push_back(support.holds[v]);
    part.spacing.push_back(support.spacing[v]);
  }
  return part;
}

}  // namespace

absl::StatusOr<ControlMesh> TrimSurface(const ControlMesh& surface, const OrientedCloud& cloud,
                                        const PointIndex& index, BoundaryRule boundary,
                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      const SurfaceSupport support,
      FindSupport(surface.vertices, VertexNormals(surface.vertices, surface.faces), cloud, index,
                  context));
  // Pieces without support go first: no hole is filled on their account.
  MeshSubset pieces = DropSmallPieces(surface, support, cloud.share_of_spacing);
  if (boundary == BoundaryRule::kClose || pieces.mesh.faces.cols() == 0) {
    return std::move(pieces.mesh);
  }
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const std::vector<int> next_on_border = NextOnBorder(pieces.mesh);
  const SurfaceSupport left = Inherit(support, pieces.source_vertex);
  const std::vector<uint8_t> keep = VerticesToKeep(pieces.mesh, next_on_border, left);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  std::vector<uint8_t> keep_face(pieces.mesh.faces.cols());
  for (int f = 0; f < pieces.mesh.faces.cols(); ++f) {
    const auto corners = pieces.mesh.faces.col(f);
    keep_face[f] = keep[corners[0]] && keep[corners[1]] && keep[corners[2]];
  }
  if (AllOf(keep_face)) {
    SmoothBorder(next_on_border, kTrimSurface.boundary_rounds, &pieces.mesh);
    return std::move(pieces.mesh);
  }
  MeshSubset cut = KeepFaces(pieces.mesh, keep_face);
  pieces.mesh = ControlMesh();
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  SurfaceSupport all = Inherit(left, cut.source_vertex);
  std::fill(all.holds.begin(), all.holds.end(), 1);
  ControlMesh trimmed = DropSmallPieces(std::move(cut.mesh), all, cloud.share_of_spacing).mesh;
  SmoothBorder(NextOnBorder(trimmed), kTrimSurface.boundary_rounds, &trimmed);
  return trimmed;
}

}  // namespace rilievo
