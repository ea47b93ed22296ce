#include "core/control/topology/trim_unmeasured.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/control/topology/mesh_subset.h"
#include "core/control/topology/settings.h"
#include "core/control/topology/surface_support.h"
#include "core/geometry/connected_parts.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"
#include "core/points/settings.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// Counts up to kCommon.gap_spacings of the median: isolated points far from each other support
// no sheet over the wide gaps between them.
double SpacingAt(const Eigen::Vector3d& position, const OrientedCloud& cloud,
                 const PointIndex& index) {
  int nearest = 0;
  double squared = 0;
  index.Nearest(position, 1, &nearest, &squared);
  return std::min(double{cloud.spacing[nearest]}, kCommon.gap_spacings * cloud.median_spacing);
}

// Connected faces that share a flag.
struct FaceRegion {
  std::vector<int> faces;
  bool touches_boundary = false;
};

std::vector<FaceRegion> RegionsOf(const MeshTopology& topology,
                                  const std::vector<uint8_t>& marked) {
  int count = 0;
  const std::vector<int> number = ConnectedParts(
      marked, [&](int f) { return topology.face_neighbors.col(f); }, &count);
  std::vector<FaceRegion> regions(static_cast<size_t>(count));
  for (int f = 0; f < topology.face_count(); ++f) {
    if (number[f] < 0) continue;
    FaceRegion& region = regions[number[f]];
    region.faces.push_back(f);
    for (const int neighbor : topology.face_neighbors.col(f)) {
      if (neighbor < 0) region.touches_boundary = true;
    }
  }
  return regions;
}

// The diameter of its bounding box, in spacings of the points nearest to its corners.
double WidthInSpacings(const ControlMesh& mesh, const FaceRegion& region,
                       const OrientedCloud& cloud, const PointIndex& index) {
  Eigen::AlignedBox3d box;
  double spacing = 0;
  for (const int f : region.faces) {
    for (const int v : mesh.faces.col(f)) {
      box.extend(mesh.vertices.col(v));
      spacing += SpacingAt(mesh.vertices.col(v), cloud, index);
    }
  }
  return box.diagonal().norm() * 3.0 * static_cast<double>(region.faces.size()) / spacing;
}

// Length of the edges that it shares with other faces.
double RimLength(const ControlMesh& mesh, const MeshTopology& topology, const FaceRegion& region) {
  std::vector<int> edges;  // those within it twice
  for (const int f : region.faces) {
    for (const int edge : topology.face_edges.col(f)) edges.push_back(edge);
  }
  std::sort(edges.begin(), edges.end());
  double length = 0;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (i + 1 < edges.size() && edges[i] == edges[i + 1]) {
      ++i;
      continue;
    }
    length += (mesh.vertices.col(topology.edge_vertices(0, edges[i])) -
               mesh.vertices.col(topology.edge_vertices(1, edges[i])))
                  .norm();
  }
  return length;
}

// Whether it is a gap that was bridged: everywhere near to measured faces, at a boundary between
// two parts of them.
absl::StatusOr<bool> IsBridge(const ControlMesh& mesh, const MeshTopology& topology,
                              const FaceRegion& region, const std::vector<int>& part, double gap,
                              const RunContext& context) {
  std::set<int> parts;
  std::vector<int> rim;
  for (const int f : region.faces) {
    for (int k = 0; k < 3; ++k) {
      const int neighbor = topology.face_neighbors(k, f);
      if (neighbor < 0 || part[neighbor] < 0) continue;
      parts.insert(part[neighbor]);
      for (const int v : topology.edge_vertices.col(topology.face_edges(k, f))) rim.push_back(v);
    }
  }
  if (rim.empty() || (region.touches_boundary && parts.size() < 2)) return false;
  const Eigen::Matrix3Xd places = mesh.vertices(Eigen::all, rim);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Build(places, {}, context));
  for (const int f : region.faces) {
    for (const int v : mesh.faces.col(f)) {
      if (!tree.HasWithin(mesh.vertices.col(v), kTrimUnmeasured.reach_of_gap * gap)) return false;
    }
  }
  return true;
}

}  // namespace

absl::StatusOr<std::vector<float>> UnmeasuredShares(const ControlMesh& mesh,
                                                    const OrientedCloud& cloud,
                                                    const PointIndex& index,
                                                    const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(mesh, kTrimUnmeasured.level, context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit, EvaluateLimit(refinement, mesh.vertices,
                                                                   kTrimUnmeasured.level, context));
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceSupport support,
                           FindSupport(limit.positions, limit.normals, cloud, index, context));
  std::vector<float> shares(mesh.faces.cols(), 0.0f);
  const Eigen::Matrix3Xi triangles = FinestFaces(refinement);
  for (int64_t f = 0; f < triangles.cols(); ++f) {
    for (const int v : triangles.col(f)) {
      shares[f >> (2 * kTrimUnmeasured.level)] +=
          support.holds[v] != 0 ? 0.0f : 1.0f / (3 << (2 * kTrimUnmeasured.level));
    }
  }
  return shares;
}

absl::StatusOr<ControlMesh> TrimUnmeasured(const ControlMesh& mesh,
                                           const std::vector<float>& unmeasured,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const FilledParts& filled, const RunContext& context) {
  if (IsLeftOut(Mechanism::kTrimUnmeasured)) return mesh;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  std::vector<uint8_t> measured(unmeasured.size()), bare(measured), keep(unmeasured.size(), 1);
  for (size_t f = 0; f < measured.size(); ++f) {
    measured[f] = static_cast<double>(unmeasured[f]) < kTrimUnmeasured.unmeasured_share;
    bare[f] = measured[f] == 0;
  }
  std::vector<int> part;  // of measured faces
  if (filled.gap > 0) {
    int parts = 0;
    part = ConnectedParts(
        measured, [&](int f) { return topology.face_neighbors.col(f); }, &parts);
  }
  for (const FaceRegion& region : RegionsOf(topology, bare)) {
    if (!region.touches_boundary &&
        (WidthInSpacings(mesh, region, cloud, index) <= kSurfaceSupport.filled_hole_spacings ||
         RimLength(mesh, topology, region) < filled.rim)) {
      continue;
    }
    if (filled.gap > 0) {
      RILIEVO_ASSIGN_OR_RETURN(const bool bridge,
                               IsBridge(mesh, topology, region, part, filled.gap, context));
      if (bridge) continue;
    }
    for (const int face : region.faces) keep[face] = 0;
  }
  if (std::count(keep.begin(), keep.end(), 0) == 0) return mesh;
  if (std::count(keep.begin(), keep.end(), 1) == 0) return mesh;
  return KeepFaces(mesh, keep).mesh;
}

}  // namespace rilievo
