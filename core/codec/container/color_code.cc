#include "core/codec/container/color_code.h"

#include <algorithm>
#include <cmath>

namespace rilievo {

Eigen::Matrix3d ColorCode::RgbFromNumbers() const {
  Eigen::Matrix3d matrix;
  for (int k = 0; k < 3; ++k) {
    for (int channel = 0; channel < 3; ++channel) {
      matrix(channel, k) = units[k] * axes[3 * k + channel] / 127.0;
    }
  }
  return matrix;
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
  const auto is_sound = [](double unit) { return std::isfinite(unit) && unit > 0; };
  if (!reader.ok() || !std::all_of(code.units.begin(), code.units.end(), is_sound)) return {};
  return code;
}

}  // namespace rilievo
