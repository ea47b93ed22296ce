// Meshes and points out: PLY, OBJ, STL.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <ostream>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "client/formats/point_layers.h"
#include "core/geometry/polygon_mesh.h"
#include "core/geometry/scan_place.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/height_source.h"

namespace rilievo {

// Binary little-endian PLY: x y z, the normals when the mesh has them (float nx ny nz), and for
// each vertex `source` (uchar, see HeightSource) when `sources` is not empty (then one a vertex).
// Coordinates are float where that keeps them to 1e-6 of the bounding-box diagonal, else double
// (map grids). Layers, if any one a vertex, become uchar red, green, blue and float intensity.
absl::Status WritePlyMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          std::ostream& out, const PointLayers& layers = {});

// Points alone, always double. `normals`: none (no columns), or one a point.
absl::Status WritePlyPoints(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals,
                            std::ostream& out);

// v, vn and f lines; each number is the shortest text that reads back the same. Colours, if any one
// a vertex, stand behind its position, 0 to 1.
absl::Status WriteObjMesh(const TriangleMesh& mesh, std::ostream& out,
                          const PointLayers& layers = {});

// v and f lines, a face of any number of corners in each.
absl::Status WriteObjPolygons(const PolygonMesh& mesh, std::ostream& out);

// Binary STL with face normals. The format holds float coordinates only, and at most 2^32 - 1
// triangles (INVALID_ARGUMENT beyond).
absl::Status WriteStlMesh(const TriangleMesh& mesh, std::ostream& out);

// INVALID_ARGUMENT unless it is one that WriteMesh() takes; `path` is named.
absl::Status CheckMeshExtension(const std::string& path, const std::string& extension);

// By the extension of `path`: .ply, .obj, .stl, .glb or .3mf; INVALID_ARGUMENT for any other.
// Layers are for .ply and .glb, their colours for .obj and .3mf too; `place` is for .glb and .3mf.
// Atomic, see WriteFileAtomically().
absl::Status WriteMesh(const std::string& path, const TriangleMesh& mesh,
                       std::span<const HeightSource> sources, const PointLayers& layers = {},
                       const ScanPlace& place = {});

// In the format of `extension`, whatever the path.
absl::Status WriteMesh(const std::string& path, const std::string& extension,
                       const TriangleMesh& mesh, std::span<const HeightSource> sources,
                       const PointLayers& layers = {}, const ScanPlace& place = {});

// The largest distance by which float coordinates move a point.
double FloatRounding(const Eigen::Matrix3Xd& points);

}  // namespace rilievo
