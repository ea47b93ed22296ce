// A surface as 3D Tiles 1.1 (OGC 22-025r4), for maps and viewers that load what they show.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/scan_place.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct TilesetOptions {
  int finest_level = 0;            // [0, surface.max_level]
  bool compressed = false;         // see WriteCompressedGlbMesh()
  int64_t most_triangles = 32768;  // of a tile, without its skirts; a control face is not split
};

struct WrittenTileset {
  int64_t tiles = 0;
  int64_t triangles = 0;  // of the finest level
  int64_t bytes = 0;      // of all files
};

// Writes tileset.json, last, and a GLB file for each tile into the folder, which exists: a tile of
// level l holds some control faces at that level, and its children, which replace it, hold the same
// faces at the next one. A tile's geometric error is at least its distance from the finest level,
// 0 there. Vertices that tiles of one level share are at the same place, but for the rounding of
// floats; compressed tiles of one level have one grid. Skirts hide the gaps between any two levels.
// A tileset.json that is there is removed first, and the tiles of one that this function wrote.
//
// The frame of the tileset is right-handed with z up, in metres (YUpFrom(), MetresPerUnitOrOne()):
// the scan's own axes and place where z points up in it. The transform of the root is a translation
// to the middle of the surface, so that map coordinates keep their detail. Where the coordinate
// reference system is known, asset.extras.crs tells it; nothing is projected.
// INVALID_ARGUMENT for a level out of range; errors of Tessellate() and WriteFileAtomically();
// PERMISSION_DENIED for old files that cannot be removed.
absl::StatusOr<WrittenTileset> WriteTileset(const std::string& folder,
                                            const DisplacedSurface& surface, const ScanPlace& place,
                                            const TilesetOptions& options,
                                            const RunContext& context);

}  // namespace rilievo
