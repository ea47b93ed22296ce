// A mesh whose vertices count one by one: a cage to subdivide, or to interpolate.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "core/geometry/polygon_mesh.h"
#include "core/geometry/scan_place.h"
#include "core/schemes/subdivide_mesh.h"

namespace rilievo {

struct GivenCage {
  PolygonMesh mesh;
  SubdivisionTags tags;  // of an OBJ, in order, each once
  ScanPlace place;
};

// Vertices and faces as they are in the file. INVALID_ARGUMENT for a file without faces.
absl::StatusOr<GivenCage> ReadGivenCage(const std::string& path);

}  // namespace rilievo
