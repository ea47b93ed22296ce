// Triangles as they come, made an oriented manifold.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

// What became of the triangles of a mesh.
struct MeshFigures {
  int64_t triangles = 0;        // as given; 0: a scan
  int64_t welded_vertices = 0;  // that became one with another at the same place
  int64_t dropped =
      0;  // a corner not finite, two corners at one place, the corners of another, no area
  int64_t flipped = 0;  // turned over, so that all of a piece face the same side
  // Of three triangles or more, or where a piece met itself with the other side: the triangles
  // there were taken apart.
  int64_t opened_edges = 0;
  int64_t triangles_used = 0;
};

// An orientable 2-manifold with or without boundary, every vertex used (see mesh_topology.h).
struct CheckedMesh {
  Eigen::Matrix3Xd vertices;       // unit frame
  Eigen::Matrix3Xi triangles;      // column = corners, counter-clockwise where the piece faces
  std::vector<int> source_vertex;  // column of the given points that each vertex came from
  SpatialFrame frame;              // rounded, as files carry it
  MeshFigures figures;
};

// Whether the triangles are a mesh's at all: INVALID_ARGUMENT, with the number of the triangle,
// unless there is at least one and every corner is one of the points.
absl::Status CheckTriangles(const PointCloud& mesh);

// What becomes of triangles with the same corners that face one side as often as the other.
enum class OppositeTriangles {
  kOne,   // one of them stays: solids glued at a whole face keep it as a wall
  kNone,  // they bound no volume: solids glued at a whole face become one
};

// Vertices at the same place become one. Where an edge has more than two triangles, the two around
// each wedge of a solid stay together, and others are apart; of triangles with the same corners one
// is taken, or none where `opposite` says so. Each piece faces the side that
// most of its area has, but a closed one whose triangles did not agree faces outwards. Pieces
// without area are dropped. INVALID_ARGUMENT as CheckTriangles(), or when no triangle is left that
// has an area, or when the mesh is too far out for the frame of a surface (kMostFrameLength).
absl::StatusOr<CheckedMesh> CheckMesh(const PointCloud& mesh, const RunContext& context,
                                      OppositeTriangles opposite = OppositeTriangles::kOne);

}  // namespace rilievo
