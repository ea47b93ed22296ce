#include "client/formats/export_axes.h"

#include <cmath>
#include <numbers>

namespace rilievo {

UpDirection UpOrZ(const ScanPlace& place) {
  return place.up == UpDirection::kUnknown ? UpDirection::kZ : place.up;
}

double MetresPerUnitOrOne(const ScanPlace& place) {
  return place.metres_per_unit > 0 ? place.metres_per_unit : 1;
}

Eigen::Quaterniond YUpFrom(UpDirection up) {
  constexpr double kQuarter = std::numbers::sqrt2 / 2;  // of a turn by 90 degrees
  switch (up) {
    case UpDirection::kX:
      return {kQuarter, 0, 0, kQuarter};
    case UpDirection::kMinusX:
      return {kQuarter, 0, 0, -kQuarter};
    case UpDirection::kZ:
      return {kQuarter, -kQuarter, 0, 0};
    case UpDirection::kMinusZ:
      return {kQuarter, kQuarter, 0, 0};
    case UpDirection::kMinusY:
      return {0, 1, 0, 0};
    default:
      return Eigen::Quaterniond::Identity();
  }
}

Eigen::Vector3d RoundOrigin(const Eigen::Vector3d& center, double diagonal) {
  const double grid = std::pow(10, std::floor(std::log10(diagonal)));
  return (center / grid).array().round() * grid + 0.0;  // no -0
}

}  // namespace rilievo
