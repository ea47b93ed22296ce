// The error that every command names first: the distance from the scan's points to the surface.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/geometry/scan_place.h"

namespace rilievo {

// Scan unit.
struct ScanError {
  double rms = 0, p95 = 0, max = 0;
  double diagonal = 0;  // that the fractions are of
  ScanPlace place = {};
};

// What a surface of this topology was made from: "scan" or "mesh".
const char* InputName(const std::string& topology);

// "RMS 0.113 m (0.0413 %), 95 % below 0.2 m (0.07 %), max 1.3 m (0.5 %)"; % of the diagonal.
std::string ScanErrorText(const ScanError& error);

// Lengths, their unit (null: that of the coordinates), and fractions of the diagonal (*_ratio).
nlohmann::ordered_json ScanErrorJson(const ScanError& error);

}  // namespace rilievo
