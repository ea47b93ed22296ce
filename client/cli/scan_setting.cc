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
// Fewer points than that tell nothing of what is around a station.
constexpr int64_t kLeastPoints = 100;
// Of the cells, this share has points indoors: nearly all have there, and hardly any in a street.
// Of the sectors, this share has points where the scene lies around the stations.
constexpr double kCovered = 0.5;

// What of its directions a station has points in.
struct Surroundings {
  int64_t points = 0;
  std::bitset<kRings * kSectors> overhead;
  std::bitset<kSectors> level;  // neither steeply above nor below
};

size_t SectorOf(const Eigen::Vector3d& way) {
  const double turn = std::atan2(way.z(), way.x()) / (2 * std::numbers::pi) + 0.5;
  return static_cast<size_t>(std::min(static_cast<int>(kSectors * turn), kSectors - 1));
}

// `rise`: sine of the elevation, above kSteep.
size_t CellOf(const Eigen::Vector3d& way, double rise) {
  const int ring = static_cast<int>(kRings * (rise - kSteep) / (1 - kSteep));
  return static_cast<size_t>(std::min(ring, kRings - 1) * kSectors) + SectorOf(way);
}

template <size_t cells>
double ShareOf(const std::vector<Surroundings>& stations,
               std::bitset<cells> Surroundings::*directions) {
  size_t all = 0, covered = 0;
  for (const Surroundings& station : stations) {
    if (station.points < kLeastPoints) continue;
    all += cells;
    covered += (station.*directions).count();
  }
  return all > 0 ? static_cast<double>(covered) / static_cast<double>(all) : 0;
}

}  // namespace

ScanSetting SettingOf(const PointCloud& scan, UpDirection up) {
  const PointSights& sights = scan.sights;
  ScanPlace place;
  place.up = up;
  const Eigen::Matrix3d y_up = YUpFrom(UpOrZ(place)).toRotationMatrix();
  std::vector<Surroundings> stations(static_cast<size_t>(sights.stations.cols()));
  int64_t seen = 0, from_above = 0;
  for (size_t i = 0; i < sights.station_of.size(); ++i) {
    const uint16_t station = sights.station_of[i];
    if (station == kNoStation) continue;
    const Eigen::Vector3d way =
        y_up * (scan.points.col(static_cast<Eigen::Index>(i)) - sights.stations.col(station));
    const double rise = way.y() / way.stableNorm();
    if (!std::isfinite(rise)) continue;
    ++seen;
    Surroundings& around = stations[station];
    ++around.points;
    if (rise < -kSteep) {
      ++from_above;
    } else if (rise > kSteep) {
      around.overhead.set(CellOf(way, rise));
    } else {
      around.level.set(SectorOf(way));
    }
  }
  if (seen > 0 && 2 * from_above > seen) return ScanSetting::kAbove;
  if (ShareOf(stations, &Surroundings::overhead) >= kCovered) return ScanSetting::kIndoors;
  if (ShareOf(stations, &Surroundings::level) >= kCovered) return ScanSetting::kGround;
  return ScanSetting::kUnknown;
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
