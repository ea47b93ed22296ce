// Points and triangles as they travel and are stored: one record after another, little-endian,
// without padding.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/geometry/point_cloud.h"

namespace rilievo {

enum class CoordinateType { kFloat32, kFloat64 };

// What a record holds, in this order: x, y, z; the number of the point's station, 16 bits; the
// point's normal, three float32; its red, green and blue, 8 bits each.
struct PointLayout {
  CoordinateType coordinates = CoordinateType::kFloat32;
  bool stations = false;
  bool normals = false;
  bool colors = false;

  // Of one record: 12 to kMostRecordBytes.
  int64_t bytes() const;
};

inline constexpr int64_t kMostRecordBytes = 41;

// All that is known of the points; float32 when every coordinate survives it unchanged (NaN and
// infinities do), else float64.
PointLayout LosslessLayout(const PointCloud& scan);

// The records of the points [begin, end). `layout` asks for nothing that the scan does not have.
std::string PackPoints(const PointCloud& scan, int64_t begin, int64_t end,
                       const PointLayout& layout);

// Room for `count` points of this layout, without a table of stations.
PointCloud RoomForPoints(int64_t count, const PointLayout& layout);

// Writes whole records to the points from `at` on; returns the one behind them. `scan`:
// RoomForPoints of the same layout.
int64_t UnpackPoints(std::string_view bytes, const PointLayout& layout, int64_t at,
                     PointCloud* scan);

// A triangle: the columns of its three corners, 32 bits each, without a sign.
inline constexpr int64_t kTriangleBytes = 12;

// The records of the triangles [begin, end).
std::string PackTriangles(const PointCloud& mesh, int64_t begin, int64_t end);

// Writes whole records to the triangles from `at` on, for which there is room; returns the one
// behind them. Corners are not compared with the points; -1 stands for one that no int holds.
int64_t UnpackTriangles(std::string_view bytes, int64_t at, PointCloud* mesh);

// Bytes of a scan, or of a mesh: its triangles come after its points.
int64_t BytesOfRecords(const PointLayout& layout, int64_t points, int64_t triangles);

}  // namespace rilievo
