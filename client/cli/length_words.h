// Lengths and units as people write them: 0.001, 0.1%, 2cm, 0.02u.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/geometry/scan_place.h"

namespace rilievo {

// Names of the units: "km", "m", ..., "us-ft".
std::vector<std::string> UnitNames();

// Metres of a unit; 0 for a name that is not among them.
double MetresOf(absl::string_view unit);

// The name of the unit of so many metres; "2.5 m" where it has none, "" for 0.
std::string UnitName(double metres);

struct Length {
  enum class Of { kDiagonal, kMetres, kScanUnits };
  double value = 0;  // > 0
  Of of = Of::kDiagonal;
  std::string text;  // as it was written
};

// A plain number is a fraction of the diagonal, and one with % is a percentage of it. A number with
// a unit is a length; the unit u is the scan's own. INVALID_ARGUMENT for anything else.
absl::StatusOr<Length> ParseLength(absl::string_view text);

// Checks an option's text; fractions must lie in [low, high].
CLI::Validator IsLength(double low, double high);

// In units of the scan, of a length that is not a fraction. kUsage, naming `option` and what to do,
// where the unit of `scan` (a path) is not known.
absl::StatusOr<double> InScanUnits(const Length& length, const ScanPlace& place,
                                   const std::string& option, const std::string& scan);

// "0.0123 m", of a length in scan units; without a unit where that is not known.
std::string LengthText(double length, const ScanPlace& place);

}  // namespace rilievo
