// Where an exported surface stands: its unit, its way up, its origin.
#pragma once

#include <Eigen/Core>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/place_options.h"
#include "core/geometry/spatial_frame.h"

namespace rilievo {

struct ExportPlaceArguments {
  PlaceArguments place;
  std::string origin;  // "auto", "X,Y,Z", or empty
};

// --unit, --up and --origin of a command; `arguments` must outlive it.
void AddExportPlace(CLI::App* app, ExportPlaceArguments* arguments);

// kUsage for options that a format with this extension does not know.
absl::Status CheckExportPlace(const ExportPlaceArguments& arguments, const std::string& output,
                              const std::string& extension);

// The point that is written as 0 0 0: the origin by default. kUsage for text that is not a point.
absl::StatusOr<Eigen::Vector3d> OriginOf(const ExportPlaceArguments& arguments,
                                         const SpatialFrame& frame);

// A sentence where STL or 3MF (float coordinates) or STEP (13 digits) moves points by more than
// 1e-6 of the diagonal; else empty.
std::string RoundingWarning(const std::string& extension, const Eigen::Matrix3Xd& vertices,
                            const ScanPlace& place);

}  // namespace rilievo
