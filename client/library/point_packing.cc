#include "client/library/point_packing.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "coordinates travel little-endian");

bool SurvivesFloat32(double value) {
  if (!std::isfinite(value)) return true;
  // Checked first: a conversion out of float's range is undefined.
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) return false;
  return static_cast<double>(static_cast<float>(value)) == value;
}

}  // namespace

v1::CoordinateFormat LosslessFormat(const PointCloud& scan) {
  const double* values = scan.points.data();
  for (Eigen::Index i = 0; i < scan.points.size(); ++i) {
    if (!SurvivesFloat32(values[i])) return v1::COORDINATE_FORMAT_FLOAT64_LE;
  }
  return v1::COORDINATE_FORMAT_FLOAT32_LE;
}

int64_t PointBytes(v1::CoordinateFormat format) {
  return format == v1::COORDINATE_FORMAT_FLOAT32_LE ? 12 : 24;
}

std::string PackPoints(const PointCloud& scan, int64_t begin, int64_t end,
                       v1::CoordinateFormat format) {
  std::string bytes(static_cast<size_t>((end - begin) * PointBytes(format)), '\0');
  const double* values = scan.points.data() + 3 * begin;
  const size_t count = static_cast<size_t>(3 * (end - begin));
  if (format == v1::COORDINATE_FORMAT_FLOAT64_LE) {
    std::memcpy(bytes.data(), values, count * sizeof(double));
    return bytes;
  }
  for (size_t i = 0; i < count; ++i) {
    const float value = static_cast<float>(values[i]);
    std::memcpy(bytes.data() + i * sizeof(float), &value, sizeof(float));
  }
  return bytes;
}

}  // namespace rilievo
