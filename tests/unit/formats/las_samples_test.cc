#include <cmath>
#include <cstring>

#include "tests/unit/formats/scan_samples.h"

namespace rilievo::testing {
namespace {

template <typename T>
void Put(T value, size_t at, std::string* bytes) {
  std::memcpy(bytes->data() + at, &value, sizeof(T));
}

// The variable length record that a reader has to pass over.
constexpr size_t kRecordBytes = 54 + 10;

std::string LasHeader(int count, int record_size, const LasSample& sample) {
  const size_t size = sample.minor == 4 ? 375 : sample.minor == 3 ? 235 : 227;
  std::string bytes(size + kRecordBytes, '\0');
  bytes.replace(0, 4, "LASF");
  Put(uint8_t{1}, 24, &bytes);
  Put(static_cast<uint8_t>(sample.minor), 25, &bytes);
  Put(static_cast<uint16_t>(size), 94, &bytes);
  Put(static_cast<uint32_t>(bytes.size()), 96, &bytes);
  Put(uint32_t{1}, 100, &bytes);
  Put(uint16_t{10}, size + 20, &bytes);
  Put(static_cast<uint8_t>(sample.point_format), 104, &bytes);
  Put(static_cast<uint16_t>(record_size), 105, &bytes);
  const bool legacy = sample.point_format < 6;
  Put(static_cast<uint32_t>(legacy ? count : 0), 107, &bytes);
  for (int axis = 0; axis < 3; ++axis) {
    Put(sample.scale, 131 + 8 * axis, &bytes);
    Put(sample.offset(axis), 155 + 8 * axis, &bytes);
  }
  if (sample.minor == 4) Put(static_cast<uint64_t>(count), 247, &bytes);
  return bytes;
}

}  // namespace

std::string LasFile(const Eigen::Matrix3Xd& points, const LasSample& sample) {
  const int sizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  const int reds[] = {-1, -1, 20, 28, -1, 28, -1, 30, 30, -1, 30};
  const int record_size = sizes[sample.point_format] + sample.extra;
  std::string bytes = LasHeader(static_cast<int>(points.cols()), record_size, sample);
  for (int i = 0; i < points.cols(); ++i) {
    std::string record(static_cast<size_t>(record_size), '\x5a');
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = (points(axis, i) - sample.offset(axis)) / sample.scale;
      Put(static_cast<int32_t>(std::lround(steps)), 4 * axis, &record);
    }
    Put(static_cast<uint16_t>(256 * i), 12, &record);
    Put(uint8_t{0}, 15, &record);
    for (int channel = 0; channel < 3 && reds[sample.point_format] > 0; ++channel) {
      Put(static_cast<uint16_t>((channel + 1) * i * sample.color_step),
          static_cast<size_t>(reds[sample.point_format] + 2 * channel), &record);
    }
    bytes += record;
  }
  return bytes;
}

std::string PtxCloud(int columns, int rows, const std::string& matrix, const std::string& points) {
  return std::to_string(columns) + "\n" + std::to_string(rows) + "\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" +
         matrix + points;
}

}  // namespace rilievo::testing
