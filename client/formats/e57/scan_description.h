// What the XML section of an E57 file says of its scans.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/e57/xml_tree.h"

namespace rilievo::e57 {

// How a field of the records is stored: Float of either precision, Integer and ScaledInteger.
enum class FieldType : uint8_t { kSingle, kDouble, kInteger, kUnread };

struct Field {
  std::string name;
  FieldType type = FieldType::kUnread;
  int bits = 0;                    // of a value; 0 where an integer can have one value only
  int64_t minimum = 0;             // value = (minimum + stored) * scale + offset
  double scale = 1, offset = 0;    // of integers
  double least = 0, greatest = 1;  // bounds of the values, where the file states them
};

// A Data3D element of ASTM E2807-11. Fields are given by their number, -1 where the scan has none.
struct ScanDescription {
  std::string name;             // "scan 2", for messages
  uint64_t section_offset = 0;  // physical
  uint64_t record_count = 0;
  std::vector<Field> fields;                // one bytestream each, in this order
  std::array<int, 3> place = {-1, -1, -1};  // x, y, z or range, azimuth, elevation
  bool spherical = false;                   // angles in radians
  int invalid_state = -1;                   // 0 for valid records
  int intensity = -1, classification = -1;
  std::array<int, 3> color = {-1, -1, -1};
  std::array<int, 3> normal = {-1, -1, -1};             // of the extension E57_NOR_surface_normals
  int color_invalid = -1;                               // 0 for records with a colour
  std::array<std::array<double, 2>, 3> color_limits{};  // darkest, brightest value a channel
  bool has_pose = false;                                // file = rotation * scan + translation
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

// The scans of a file in their order, those without records too. INVALID_ARGUMENT, with the element
// and its value, for what cannot be read: fields without bounds that make sense, codecs other than
// bit packing, a scan without coordinates.
absl::StatusOr<std::vector<ScanDescription>> DescribeScans(const XmlElement& root);

}  // namespace rilievo::e57
