#include "core/geometry/point_sights.h"

#include "absl/strings/str_cat.h"

namespace rilievo {

absl::Status CheckSights(const PointSights& sights, int64_t points) {
  const Eigen::Index stations = sights.stations.cols();
  if (stations > kMostStations) {
    return absl::InvalidArgumentError(absl::StrCat("stations: ", stations, " places; at most ",
                                                   kMostStations, " are told apart, merge some"));
  }
  for (Eigen::Index i = 0; i < stations; ++i) {
    if (sights.stations.col(i).allFinite()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("stations: the place of station ", i,
                     " is not finite; give its place or leave the station out"));
  }
  const auto numbers = static_cast<int64_t>(sights.station_of.size());
  if (numbers != 0 && numbers != points) {
    return absl::InvalidArgumentError(absl::StrCat("stations: ", numbers, " station numbers for ",
                                                   points, " points; give one for each point"));
  }
  for (int64_t i = 0; i < numbers; ++i) {
    if (sights.station_of[i] < stations || sights.station_of[i] == kNoStation) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("stations: point ", i, " names station ", sights.station_of[i], " of ",
                     stations, "; count from 0, ", kNoStation, " where it is not known"));
  }
  const Eigen::Index normals = sights.normals.cols();
  if (normals != 0 && normals != points) {
    return absl::InvalidArgumentError(absl::StrCat("normals: ", normals, " normals for ", points,
                                                   " points; give one for each point"));
  }
  const size_t colors = sights.colors.size();
  if (colors != 0 && static_cast<int64_t>(colors) != points) {
    return absl::InvalidArgumentError(absl::StrCat("colors: ", colors, " colours for ", points,
                                                   " points; give one for each point"));
  }
  return absl::OkStatus();
}

PointSights SightsOf(const PointSights& sights, std::span<const int> columns) {
  PointSights chosen;
  if (!sights.station_of.empty()) {
    chosen.stations = sights.stations;
    chosen.station_of.reserve(columns.size());
    for (const int column : columns) chosen.station_of.push_back(sights.station_of[column]);
  }
  if (!sights.colors.empty()) {
    chosen.colors.reserve(columns.size());
    for (const int column : columns) chosen.colors.push_back(sights.colors[column]);
  }
  if (sights.normals.cols() == 0) return chosen;
  chosen.normals.resize(3, static_cast<Eigen::Index>(columns.size()));
  for (size_t i = 0; i < columns.size(); ++i) {
    chosen.normals.col(static_cast<Eigen::Index>(i)) = sights.normals.col(columns[i]);
  }
  return chosen;
}

void KeepSights(std::span<const uint8_t> keep, PointSights* sights) {
  Eigen::Index count = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    if (!sights->station_of.empty()) sights->station_of[count] = sights->station_of[i];
    if (sights->normals.cols() != 0) {
      sights->normals.col(count) = sights->normals.col(static_cast<Eigen::Index>(i));
    }
    if (!sights->colors.empty()) sights->colors[count] = sights->colors[i];
    ++count;
  }
  if (!sights->station_of.empty()) sights->station_of.resize(static_cast<size_t>(count));
  if (sights->normals.cols() != 0) sights->normals.conservativeResize(3, count);
  if (!sights->colors.empty()) sights->colors.resize(static_cast<size_t>(count));
}

}  // namespace rilievo
