// From where a scan was made: from above, from the ground, or indoors.
#pragma once

#include "core/geometry/point_cloud.h"
#include "core/geometry/scan_place.h"

namespace rilievo {

enum class ScanSetting {
  kUnknown,  // no station has seen enough of the points, or they stood aside, as of a thing on a
             // table
  kAbove,    // by an aircraft: most points were seen steeply from above
  kGround,   // outdoors: the scene lies around the stations, the sky is open
  kIndoors,  // or underground: points lie overhead
};

// By the stations of the points; z points up where `up` is unknown.
ScanSetting SettingOf(const PointCloud& scan, UpDirection up);

const char* SettingName(ScanSetting setting);  // as JSON has it: "unknown", "above", ...

}  // namespace rilievo
