#include "core/codec/container/color_code.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

constexpr double kFull = 255.0 * (1 << 24);

}  // namespace

Eigen::Matrix3d ColorCode::RgbFromNumbers() const {
  Eigen::Matrix3d matrix;
  for (int k = 0; k < 3; ++k) {
    for (int channel = 0; channel < 3; ++channel) {
      matrix(channel, k) = units[k] * axes[3 * k + channel] / 127.0;
    }
  }
  return matrix;
}

ColorDecoder::ColorDecoder(const ColorCode& code) : weights_() {
  for (size_t i = 0; i < weights_.size(); ++i) {
    weights_[i] = std::llround(code.units[i / 3] * code.axes[i] * kFull / 127);
  }
}

Rgb ColorDecoder::ColorOf(const std::array<int32_t, 3>& numbers) const {
  Rgb color;
  for (size_t channel = 0; channel < 3; ++channel) {
    int64_t sum = int64_t{1} << 23;
    for (size_t k = 0; k < 3; ++k) sum += numbers[k] * weights_[3 * k + channel];
    color[channel] = static_cast<uint8_t>(std::clamp<int64_t>(sum >> 24, 0, 255));
  }
  return color;
}

std::vector<uint8_t> WriteColorCode(const ColorCode& code) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  for (const double unit : code.units) writer.ShortF64(unit);
  for (const int8_t part : code.axes) writer.Byte(static_cast<uint8_t>(part));
  return bytes;
}

ColorCode ReadColorCode(ByteReader& reader) {
  ColorCode code;
  for (double& unit : code.units) unit = reader.ShortF64();
  for (int8_t& part : code.axes) part = static_cast<int8_t>(reader.Byte());
  const auto is_sound = [](double unit) { return unit > 0 && unit <= 1; };
  if (!reader.ok() || !std::all_of(code.units.begin(), code.units.end(), is_sound)) return {};
  return code;
}

}  // namespace rilievo
