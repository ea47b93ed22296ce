// A surface cut into tiles at every level of detail.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Some control faces at one level.
struct SurfaceTile {
  int level = 0;
  std::vector<int> faces;     // control faces, ascending
  int parent = -1;            // -1: none
  std::vector<int> children;  // of the next level; together they have the same faces
  // How far the tile may be from the finest level, unit of the meshes; 0 at the finest level.
  double error = 0;
  // How far its faces may be at any level from where they are at any other, unit of the meshes.
  double spread = 0;
};

// Parents before their children. One tile has all faces of level 0, or, where these are more than
// `most_triangles`, several have none above them. Tiles of a level are the groups of GroupFaces()
// with at most `most_triangles` triangles, or one control face.
absl::StatusOr<std::vector<SurfaceTile>> CutIntoTiles(const ControlMesh& control, int finest_level,
                                                      int64_t most_triangles);

// Gives the tiles their errors and spreads. `levels`: tessellations of the surface, of level 0 to
// the finest. The error is the sum, over the levels that are still to come, of the largest distance
// between a new vertex in the tile and the middle of the edge that it splits; the spread is that
// over all levels.
void MeasureTiles(const std::vector<TriangleMesh>& levels, std::vector<SurfaceTile>* tiles);

}  // namespace rilievo
