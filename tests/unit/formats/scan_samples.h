// Small scans in every format, made in memory: the readers' tests stand on these alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/scan_reader.h"

namespace rilievo::testing {

// Points of the unit sphere that float holds exactly, `count` of them.
Eigen::Matrix3Xd SpherePoints(int count);

struct NamedBytes {
  std::string name;  // with the extension that fits
  std::string bytes;
  int points;  // that a reader must find; the first columns of SpherePoints
};

// A LAS file of the points as round((p - offset) / scale), with intensity 256 i and red, green,
// blue i, 2 i, 3 i times `color_step` for point i. `minor`: of the version 1.x; records end with
// `extra` bytes.
struct LasSample {
  int minor = 2, point_format = 0;
  double scale = 0x1p-20;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  int extra = 0, color_step = 1;
};
std::string LasFile(const Eigen::Matrix3Xd& points, const LasSample& sample);

// A cloud of a PTX file, without colours; `matrix`: its 16 numbers as text.
std::string PtxCloud(int columns, int rows, const std::string& matrix, const std::string& points);
inline constexpr char kIdentity[] = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

// Every format and variant, each valid.
std::vector<NamedBytes> ValidScans(int points);

// Read from memory, by content and the name's extension.
absl::StatusOr<ScanFile> ReadBytes(const std::string& bytes, const std::string& name);

// Raw bytes of a value in either byte order.
template <typename T>
std::string Raw(T value, bool big_endian = false) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof(T));
  if (big_endian) raw.assign(raw.rbegin(), raw.rend());
  return raw;
}

std::string PlyHeaderText(const std::string& format, const std::string& vertex_count,
                          const std::string& properties =
                              "property float x\nproperty float y\n"
                              "property float z\n");

// x y z as floats, little-endian.
std::string FloatRows(const Eigen::Matrix3Xd& points, bool big_endian = false);

// One line a point.
std::string TextRows(const Eigen::Matrix3Xd& points, const std::string& separator = " ",
                     const std::string& line_end = "\n");

}  // namespace rilievo::testing
