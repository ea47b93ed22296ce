// Triangle meshes from OBJ, PLY and STL.
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct MeshFile {
  // Polygons are cut into fans. `triangles` is empty when the file holds points alone; `normals`
  // only when each vertex has one.
  TriangleMesh mesh;
  std::vector<uint8_t> source;  // vertex property 'source' of a PLY (see HeightSource), or empty
  std::string format;           // for people
  ScanPlace place = {};         // of formats of scans, see ScanFile
};

// As the scan readers: streaming, no count believed before the bytes allow it. INVALID_ARGUMENT
// also for indices that name no vertex.
absl::StatusOr<MeshFile> ReadPlyMesh(std::istream& in);
absl::StatusOr<MeshFile> ReadObjMesh(std::istream& in);
// Binary or ascii; equal corners become one vertex.
absl::StatusOr<MeshFile> ReadStlMesh(std::istream& in);

// By content first, by the extension of `name` second.
absl::StatusOr<MeshFile> ReadMeshStream(std::istream& in, const std::string& name);

// PLY, OBJ or STL by content first, extension second; other formats of points (PCD, XYZ) come back
// without triangles. "-" reads the standard input. Errors as ReadScan().
absl::StatusOr<MeshFile> ReadMesh(const std::string& path);

}  // namespace rilievo
