// The triangles of one tile, with skirts that hide the gaps to tiles of other levels.
#pragma once

#include <cstdint>
#include <vector>

#include "client/formats/point_layers.h"
#include "client/formats/tiles/tile_tree.h"
#include "core/geometry/rgb.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/height_source.h"

namespace rilievo {

// One level of a surface, whole: the triangles of a control face stand together.
struct SurfaceLevel {
  const TriangleMesh& mesh;
  const std::vector<HeightSource>& sources;  // one a vertex
  const std::vector<Rgb>& colors;            // same, or empty
  int triangles_per_face = 1;
};

// Half-edges (from << 32 | to), ascending.
using HalfEdges = std::vector<uint64_t>;

// Those of the tile's triangles without an opposite in it.
HalfEdges RimOf(const SurfaceLevel& level, const SurfaceTile& tile);

struct TileMesh {
  TriangleMesh mesh;
  std::vector<HeightSource> sources;
  PointLayers layers;
};

// Where the tile meets another, its rim is drawn out by its spread against the vertices' normals,
// for the other may be shown at any level; borders of the surface itself stay as they are. `rims`:
// of all tiles of the level.
TileMesh MeshOfTile(const SurfaceLevel& level, const SurfaceTile& tile, const HalfEdges& rims);

}  // namespace rilievo
