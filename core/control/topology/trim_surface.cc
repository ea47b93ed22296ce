#include "core/control/topology/trim_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/simplify/mesh_subset.h"
#include "core/control/topology/surface_support.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

// What wrong normals leave between two sheets is a bubble a few spacings wide.
constexpr double kFewestOfPiece = 25;
constexpr int kBoundaryRounds = 4;  // of smoothing, where the surface was cut

// How the vertices of a manifold hang together.
struct Links {
  std::vector<int> begin, vertices;  // those joined by edges, as flat lists
  std::vector<int> next_on_border;   // where the border goes on from a vertex; -1 off it
};

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

Links LinkVertices(const ControlMesh& mesh) {
  Links links;
  const auto vertex_count = static_cast<int>(mesh.vertices.cols());
  links.begin.assign(static_cast<size_t>(vertex_count) + 1, 0);
  links.next_on_border = NextOnBorder(mesh);
  std::vector<std::array<int, 2>> edges;
  edges.reserve(static_cast<size_t>(mesh.faces.cols()) * 8 / 5);
  ForEachEdge(mesh.faces, vertex_count, [&](int low, int high, const HalfEdgeGroup& /*edge*/) {
    edges.push_back({low, high});
    ++links.begin[low + 1];
    ++links.begin[high + 1];
  });
  std::partial_sum(links.begin.begin(), links.begin.end(), links.begin.begin());
  links.vertices.resize(links.begin.back());
  // Filling moves each begin to the next vertex's.
  for (const auto& [low, high] : edges) {
    links.vertices[links.begin[low]++] = high;
    links.vertices[links.begin[high]++] = low;
  }
  std::copy_backward(links.begin.begin(), links.begin.end() - 1, links.begin.end());
  links.begin.front() = 0;
  return links;
}

// A connected set of vertices that share a flag.
struct Region {
  std::vector<int> vertices;
  bool touches_border = false;
  double diameter = 0;  // of its bounding box
  double spacing = 0;   // mean over its vertices
};

std::vector<Region> RegionsWithoutSupport(const ControlMesh& mesh, const Links& links,
                                          const SurfaceSupport& support) {
  std::vector<Region> regions;
  std::vector<uint8_t> seen(support.holds);
  for (int seed = 0; seed < static_cast<int>(seen.size()); ++seed) {
    if (seen[seed] != 0) continue;
    Region region;
    region.vertices.push_back(seed);
    seen[seed] = 1;
    Eigen::Vector3d low = mesh.vertices.col(seed), high = low;
    for (size_t i = 0; i < region.vertices.size(); ++i) {
      const int v = region.vertices[i];
      low = low.cwiseMin(mesh.vertices.col(v));
      high = high.cwiseMax(mesh.vertices.col(v));
      region.spacing += support.spacing[v];
      region.touches_border = region.touches_border || links.next_on_border[v] >= 0;
      for (int e = links.begin[v]; e < links.begin[v + 1]; ++e) {
        if (seen[links.vertices[e]] != 0) continue;
        seen[links.vertices[e]] = 1;
        region.vertices.push_back(links.vertices[e]);
      }
    }
    region.diameter = (high - low).norm();
    region.spacing /= static_cast<double>(region.vertices.size());
    regions.push_back(std::move(region));
  }
  return regions;
}

bool AllOf(const std::vector<uint8_t>& flags) {
  return std::find(flags.begin(), flags.end(), 0) == flags.end();
}

// Drops connected pieces whose supported area holds fewer points than kFewestOfPiece, a point on
// each squared spacing; the largest only where it is a scrap. `mesh`: no vertex unused, and each
// fan with a vertex of its own.
MeshSubset DropSmallPieces(ControlMesh mesh, const SurfaceSupport& support,
                           double share_of_spacing) {
  std::vector<int> parent(mesh.vertices.cols());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    parent[find(mesh.faces(1, f))] = find(mesh.faces(0, f));
    parent[find(mesh.faces(2, f))] = find(mesh.faces(0, f));
  }
  std::vector<double> points(parent.size(), 0);
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const auto corners = mesh.faces.col(f);
    if (!support.holds[corners[0]] || !support.holds[corners[1]] || !support.holds[corners[2]]) {
      continue;
    }
    const Eigen::Vector3d a = mesh.vertices.col(corners[0]);
    const Eigen::Vector3d b = mesh.vertices.col(corners[1]) - a;
    const Eigen::Vector3d c = mesh.vertices.col(corners[2]) - a;
    const double spacing = support.spacing[corners[0]];
    points[find(corners[0])] += b.cross(c).norm() / 2 / (spacing * spacing);
  }
  constexpr double kLeastOfAll = 4;  // no scrap of fewer points is a surface, though the largest
  const double most = points.empty() ? 0 : *std::max_element(points.begin(), points.end());
  const double fewest = kFewestOfPiece * share_of_spacing * share_of_spacing;
  const double least = std::max(std::min(fewest, most), kLeastOfAll);
  std::vector<uint8_t> keep(mesh.faces.cols());
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const double here = points[find(mesh.faces(0, f))];
    keep[f] = here >= least;
  }
  if (!AllOf(keep)) return KeepFaces(mesh, keep);
  MeshSubset all{std::move(mesh), {}};
  all.source_vertex.resize(all.mesh.vertices.cols());
  std::iota(all.source_vertex.begin(), all.source_vertex.end(), 0);
  return all;
}

// What stays of the surface of an open scan: supported vertices and small holes.
std::vector<uint8_t> VerticesToKeep(const ControlMesh& surface, const Links& links,
                                    const SurfaceSupport& support) {
  std::vector<uint8_t> keep = support.holds;
  for (const Region& region : RegionsWithoutSupport(surface, links, support)) {
    const bool small = region.diameter <= kFilledHoleSpacings * region.spacing;
    if (!small || region.touches_border) continue;
    for (const int v : region.vertices) keep[v] = 1;
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
  Links links = LinkVertices(pieces.mesh);
  const SurfaceSupport left = Inherit(support, pieces.source_vertex);
  const std::vector<uint8_t> keep = VerticesToKeep(pieces.mesh, links, left);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  std::vector<uint8_t> keep_face(pieces.mesh.faces.cols());
  for (int f = 0; f < pieces.mesh.faces.cols(); ++f) {
    const auto corners = pieces.mesh.faces.col(f);
    keep_face[f] = keep[corners[0]] && keep[corners[1]] && keep[corners[2]];
  }
  if (AllOf(keep_face)) {
    SmoothBorder(links.next_on_border, kBoundaryRounds, &pieces.mesh);
    return std::move(pieces.mesh);
  }
  links = Links();
  MeshSubset cut = KeepFaces(pieces.mesh, keep_face);
  pieces.mesh = ControlMesh();
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  SurfaceSupport all = Inherit(left, cut.source_vertex);
  std::fill(all.holds.begin(), all.holds.end(), 1);
  ControlMesh trimmed = DropSmallPieces(std::move(cut.mesh), all, cloud.share_of_spacing).mesh;
  SmoothBorder(NextOnBorder(trimmed), kBoundaryRounds, &trimmed);
  return trimmed;
}

}  // namespace rilievo
