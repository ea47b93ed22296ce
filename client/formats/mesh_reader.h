// Triangle meshes from GLB, OBJ, PLY and STL.
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/polygon_mesh.h"
#include "core/geometry/rgb.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Sharp edges and vertices, as `rilievo export --cage` writes them into an OBJ.
struct MeshTags {
  std::vector<Crease> creases;
  std::vector<int> corners;
};

struct MeshFile {
  // Polygons are cut into fans. `triangles` is empty when the file holds points alone; `normals`
  // only when each vertex has one.
  TriangleMesh mesh;
  std::vector<uint8_t> source;  // vertex property 'source' of a PLY (see HeightSource), or empty
  std::vector<Rgb> colors;      // where each vertex has one, or empty
  std::string format;           // for people
  ScanPlace place = {};         // of formats of scans, see ScanFile; of GLB metres, y up
  // Of each face of a PLY or OBJ in turn its number of corners, where some are no triangles.
  std::vector<int> corner_counts = {};
  std::optional<MeshTags> tags = {};  // of an OBJ with lines 't crease' or 't corner'
};

// Its faces as they were before they were cut into fans.
PolygonMesh PolygonsOf(const MeshFile& file);

// As the scan readers: streaming, no count believed before the bytes allow it. INVALID_ARGUMENT
// also for indices that name no vertex.
absl::StatusOr<MeshFile> ReadPlyMesh(std::istream& in);
absl::StatusOr<MeshFile> ReadObjMesh(std::istream& in);
// Binary or ascii; equal corners become one vertex.
absl::StatusOr<MeshFile> ReadStlMesh(std::istream& in);

// Binary glTF 2.0: all triangles, strips and fans of the default scene (of all root nodes where the
// file names none), moved by their nodes into its frame, which is y up and in metres; they keep
// that. A node that mirrors turns them over. Corners at the same place become one vertex, for the
// format splits vertices by normals and texture places; triangles without three are left out. Of a
// vertex with several colours the first is taken. Points, lines, morph targets and textures are
// passed over; INVALID_ARGUMENT for skins, sparse accessors, other buffers than the file's own, and
// required extensions that store the geometry otherwise (Draco); EXT_meshopt_compression and
// KHR_mesh_quantization are read.
absl::StatusOr<MeshFile> ReadGlbMesh(std::istream& in);

// By content first, by the extension of `name` second.
absl::StatusOr<MeshFile> ReadMeshStream(std::istream& in, const std::string& name);

// PLY, OBJ, STL or GLB by content first, extension second; other formats of points (PCD, XYZ) come
// back without triangles. "-" reads the standard input. Errors as ReadScan().
absl::StatusOr<MeshFile> ReadMesh(const std::string& path);

}  // namespace rilievo
