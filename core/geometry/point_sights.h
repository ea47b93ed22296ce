// Where the points of a scan were seen from, and the normals and colours that came with them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/rgb.h"

namespace rilievo {

// At most so many places of the sensor are told apart.
inline constexpr int kMostStations = 4096;
// The station of a point whose station is not known.
inline constexpr uint16_t kNoStation = 65535;

struct PointSights {
  // Column = place of the sensor, in the frame of the points.
  Eigen::Matrix3Xd stations;
  // By point: its column of `stations`, or kNoStation. Empty when no station is known.
  std::vector<uint16_t> station_of;
  // Column = point, as given: of any length, zero or not finite where not known. No columns when no
  // normal is known.
  Eigen::Matrix3Xf normals;
  // By point. Empty when no colours are known.
  std::vector<Rgb> colors;
};

// INVALID_ARGUMENT, with the field and its value, unless the sights are those of `points` points:
// one station number for each and none beyond the table, one normal and one colour for each, finite
// places.
absl::Status CheckSights(const PointSights& sights, int64_t points);

// The sights of the points at `columns`, in that order, with all stations.
PointSights SightsOf(const PointSights& sights, std::span<const int> columns);

// Keeps the sights of the points whose entry in `keep` is not 0.
void KeepSights(std::span<const uint8_t> keep, PointSights* sights);

}  // namespace rilievo
