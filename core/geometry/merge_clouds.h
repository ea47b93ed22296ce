// Several scans of one thing as one scan.
#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"

namespace rilievo {

// The points of all clouds in their order, which share a frame. The stations of each follow those
// of the ones before it, so that no two clouds share a number; points of a cloud without stations,
// or without normals, have none (kNoStation, NaN) where another cloud has them; colours are there
// where every cloud has them. INVALID_ARGUMENT for sights that are not those of their points, and
// for more than kMostStations stations in all.
absl::StatusOr<PointCloud> MergeClouds(std::span<const PointCloud> clouds);

}  // namespace rilievo
