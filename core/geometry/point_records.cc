#include "core/geometry/point_records.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "records travel little-endian");

constexpr size_t kNormalBytes = 3 * sizeof(float);

bool SurvivesFloat32(double value) {
  if (!std::isfinite(value)) return true;
  // Checked first: a conversion out of float's range is undefined.
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) return false;
  return static_cast<double>(static_cast<float>(value)) == value;
}

bool AllSurviveFloat32(const Eigen::Matrix3Xd& points) {
  const double* values = points.data();
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    if (!SurvivesFloat32(values[i])) return false;
  }
  return true;
}

// The coordinates of one point; return the place behind them.
char* Pack(const double* values, CoordinateType type, char* target) {
  if (type == CoordinateType::kFloat64) {
    std::memcpy(target, values, 3 * sizeof(double));
    return target + 3 * sizeof(double);
  }
  for (int axis = 0; axis < 3; ++axis, target += sizeof(float)) {
    const auto value = static_cast<float>(values[axis]);
    std::memcpy(target, &value, sizeof(float));
  }
  return target;
}

const char* Unpack(const char* bytes, CoordinateType type, double* values) {
  if (type == CoordinateType::kFloat64) {
    std::memcpy(values, bytes, 3 * sizeof(double));
    return bytes + 3 * sizeof(double);
  }
  for (int axis = 0; axis < 3; ++axis, bytes += sizeof(float)) {
    float value;
    std::memcpy(&value, bytes, sizeof(float));
    values[axis] = value;
  }
  return bytes;
}

}  // namespace

int64_t PointLayout::bytes() const {
  const size_t coordinate_bytes =
      coordinates == CoordinateType::kFloat32 ? 3 * sizeof(float) : 3 * sizeof(double);
  return static_cast<int64_t>(coordinate_bytes + (stations ? sizeof(uint16_t) : 0) +
                              (normals ? kNormalBytes : 0) + (colors ? sizeof(Rgb) : 0));
}

PointLayout LosslessLayout(const PointCloud& scan) {
  return {.coordinates =
              AllSurviveFloat32(scan.points) ? CoordinateType::kFloat32 : CoordinateType::kFloat64,
          .stations = scan.sights.stations.cols() != 0,
          .normals = scan.sights.normals.cols() != 0,
          .colors = !scan.sights.colors.empty()};
}

std::string PackPoints(const PointCloud& scan, int64_t begin, int64_t end,
                       const PointLayout& layout) {
  std::string bytes(static_cast<size_t>((end - begin) * layout.bytes()), '\0');
  char* target = bytes.data();
  for (int64_t i = begin; i < end; ++i) {
    target = Pack(scan.points.col(i).data(), layout.coordinates, target);
    if (layout.stations) {
      std::memcpy(target, &scan.sights.station_of[i], sizeof(uint16_t));
      target += sizeof(uint16_t);
    }
    if (layout.normals) {
      std::memcpy(target, scan.sights.normals.col(i).data(), kNormalBytes);
      target += kNormalBytes;
    }
    if (layout.colors) {
      std::memcpy(target, scan.sights.colors[i].data(), sizeof(Rgb));
      target += sizeof(Rgb);
    }
  }
  return bytes;
}

PointCloud RoomForPoints(int64_t count, const PointLayout& layout) {
  PointCloud scan;
  scan.points.resize(3, count);
  if (layout.stations) scan.sights.station_of.resize(static_cast<size_t>(count));
  if (layout.normals) scan.sights.normals.resize(3, count);
  if (layout.colors) scan.sights.colors.resize(static_cast<size_t>(count));
  return scan;
}

int64_t UnpackPoints(std::string_view bytes, const PointLayout& layout, int64_t at,
                     PointCloud* scan) {
  const char* next = bytes.data();
  const char* const end = next + bytes.size();
  for (; next != end; ++at) {
    next = Unpack(next, layout.coordinates, scan->points.col(at).data());
    if (layout.stations) {
      std::memcpy(&scan->sights.station_of[at], next, sizeof(uint16_t));
      next += sizeof(uint16_t);
    }
    if (layout.normals) {
      std::memcpy(scan->sights.normals.col(at).data(), next, kNormalBytes);
      next += kNormalBytes;
    }
    if (layout.colors) {
      std::memcpy(scan->sights.colors[at].data(), next, sizeof(Rgb));
      next += sizeof(Rgb);
    }
  }
  return at;
}

std::string PackTriangles(const PointCloud& mesh, int64_t begin, int64_t end) {
  return {reinterpret_cast<const char*>(mesh.triangles.data() + 3 * begin),
          static_cast<size_t>((end - begin) * kTriangleBytes)};
}

int64_t UnpackTriangles(std::string_view bytes, int64_t at, PointCloud* mesh) {
  int* corner = mesh->triangles.data() + 3 * at;
  for (size_t next = 0; next < bytes.size(); next += sizeof(uint32_t), ++corner) {
    uint32_t value;
    std::memcpy(&value, bytes.data() + next, sizeof(value));
    *corner = value > uint32_t{std::numeric_limits<int>::max()} ? -1 : static_cast<int>(value);
  }
  return at + static_cast<int64_t>(bytes.size()) / kTriangleBytes;
}

int64_t BytesOfRecords(const PointLayout& layout, int64_t points, int64_t triangles) {
  return points * layout.bytes() + triangles * kTriangleBytes;
}

}  // namespace rilievo
