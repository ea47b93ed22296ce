#include "core/geometry/merge_clouds.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

struct Sizes {
  Eigen::Index points = 0, stations = 0;
  bool station_of = false, normals = false, colors = true;
};

absl::StatusOr<Sizes> SizesOf(std::span<const PointCloud> clouds) {
  Sizes sizes;
  for (const PointCloud& cloud : clouds) {
    RILIEVO_RETURN_IF_ERROR(CheckSights(cloud.sights, cloud.points.cols()));
    sizes.points += cloud.points.cols();
    sizes.stations += cloud.sights.stations.cols();
    sizes.station_of |= !cloud.sights.station_of.empty();
    sizes.normals |= cloud.sights.normals.cols() > 0;
    sizes.colors &= !cloud.sights.colors.empty();
  }
  if (sizes.stations <= kMostStations) return sizes;
  return absl::InvalidArgumentError(
      absl::StrCat("stations: ", sizes.stations, " places in all scans together; at most ",
                   kMostStations, " are told apart, merge fewer scans or leave stations out"));
}

}  // namespace

absl::StatusOr<PointCloud> MergeClouds(std::span<const PointCloud> clouds) {
  RILIEVO_ASSIGN_OR_RETURN(const Sizes sizes, SizesOf(clouds));
  PointCloud merged{Eigen::Matrix3Xd(3, sizes.points)};
  PointSights& sights = merged.sights;
  sights.stations.resize(3, sizes.stations);
  if (sizes.station_of) sights.station_of.assign(static_cast<size_t>(sizes.points), kNoStation);
  if (sizes.normals) {
    sights.normals.setConstant(3, sizes.points, std::numeric_limits<float>::quiet_NaN());
  }
  Eigen::Index point = 0, station = 0;
  for (const PointCloud& cloud : clouds) {
    const Eigen::Index count = cloud.points.cols(), stations = cloud.sights.stations.cols();
    merged.points.middleCols(point, count) = cloud.points;
    sights.stations.middleCols(station, stations) = cloud.sights.stations;
    for (size_t i = 0; i < cloud.sights.station_of.size(); ++i) {
      const uint16_t own = cloud.sights.station_of[i];
      if (own == kNoStation) continue;
      sights.station_of[static_cast<size_t>(point) + i] = static_cast<uint16_t>(own + station);
    }
    if (cloud.sights.normals.cols() > 0) {
      sights.normals.middleCols(point, count) = cloud.sights.normals;
    }
    if (sizes.colors) {
      sights.colors.insert(sights.colors.end(), cloud.sights.colors.begin(),
                           cloud.sights.colors.end());
    }
    point += count;
    station += stations;
  }
  return merged;
}

}  // namespace rilievo
