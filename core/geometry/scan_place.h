// What the coordinates of a scan stand for: their unit, the way up, and their place on the Earth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace rilievo {

enum class UpDirection : uint8_t { kUnknown, kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

// A text of a coordinate reference system is refused beyond this: LAS records hold no more.
inline constexpr size_t kMaxCrsBytes = 65535;

// Nothing is computed from it: it travels with the surface, for those who export or measure.
struct ScanPlace {
  double metres_per_unit = 0;  // > 0; 0: unknown
  UpDirection up = UpDirection::kUnknown;
  std::string crs;  // well-known text (OGC WKT) or "EPSG:25832"; empty: unknown

  bool operator==(const ScanPlace&) const = default;
};

}  // namespace rilievo
