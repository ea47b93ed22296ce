#include "client/cli/scan_setting.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "client/formats/export_axes.h"

namespace rilievo {
namespace {

// Sine of 45 degrees: what is seen steeply, from above or from below. Scanners in the air look down
// more steeply than that, those on tripods see a quarter of a room so.
const double kSteep = std::numbers::sqrt2 / 2;
// The directions that are steeper, about the way up, in cells of equal solid angle.
constexpr int kRings = 4, kSectors = 8;
// Fewer points than that tell nothing of what is overhead.
constexpr int64_t kLeastPoints = 100;
// Of the cells, this share has points indoors: nearly all have there, and hardly any in a street.
constexpr double kCovered = 0.5;

using Overhead = std::bitset<kRings * kSectors>;

// `rise`: sine of the elevation, above kSteep.
size_t CellOf(const Eigen::Vector3d& way, double rise) {
  const double turn = std::atan2(way.z(), way.x()) / (2 * std::numbers::pi) + 0.5;
  const int ring = static_cast<int>(kRings * (rise - kSteep) / (1 - kSteep));
  const int sector = static_cast<int>(kSectors * turn);
  return static_cast<size_t>(std::min(ring, kRings - 1) * kSectors +
                             std::min(sector, kSectors - 1));
}

}  // namespace

ScanSetting SettingOf(const PointCloud& scan, UpDirection up) {
  const PointSights& sights = scan.sights;
  ScanPlace place;
  place.up = up;
  const Eigen::Matrix3d y_up = YUpFrom(UpOrZ(place)).toRotationMatrix();
  const auto stations = static_cast<size_t>(sights.stations.cols());
  std::vector<Overhead> overhead(stations);
  std::vector<int64_t> points(stations);
  int64_t seen = 0, from_above = 0;
  for (size_t i = 0; i < sights.station_of.size(); ++i) {
    const uint16_t station = sights.station_of[i];
    if (station == kNoStation) continue;
    const Eigen::Vector3d way =
        y_up * (scan.points.col(static_cast<Eigen::Index>(i)) - sights.stations.col(station));
    const double rise = way.y() / way.stableNorm();
    if (!std::isfinite(rise)) continue;
    ++seen;
    ++points[station];
    if (rise < -kSteep) ++from_above;
    if (rise > kSteep) overhead[station].set(CellOf(way, rise));
  }
  if (seen > 0 && 2 * from_above > seen) return ScanSetting::kAbove;
  size_t cells = 0, covered = 0;
  for (size_t station = 0; station < stations; ++station) {
    if (points[station] < kLeastPoints) continue;
    cells += overhead[station].size();
    covered += overhead[station].count();
  }
  if (cells == 0) return ScanSetting::kUnknown;
  const bool roof = static_cast<double>(covered) >= kCovered * static_cast<double>(cells);
  return roof ? ScanSetting::kIndoors : ScanSetting::kGround;
}

const char* SettingName(ScanSetting setting) {
  switch (setting) {
    case ScanSetting::kAbove:
      return "above";
    case ScanSetting::kGround:
      return "ground";
    case ScanSetting::kIndoors:
      return "indoors";
    case ScanSetting::kUnknown:
      break;
  }
  return "unknown";
}

}  // namespace rilievo
