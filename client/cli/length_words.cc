#include "client/cli/length_words.h"

#include <array>
#include <charconv>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/exit_code.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

// As a fraction, so that 7cm is the double nearest to 0.07.
struct Unit {
  const char* name;
  double numerator, denominator;  // metres
};
constexpr std::array<Unit, 9> kUnits = {{{"km", 1000, 1},
                                         {"m", 1, 1},
                                         {"dm", 1, 10},
                                         {"cm", 1, 100},
                                         {"mm", 1, 1000},
                                         {"um", 1, 1'000'000},
                                         {"in", 254, 10'000},
                                         {"ft", 3048, 10'000},
                                         {"us-ft", 1200, 3937}}};

const Unit* FindUnit(absl::string_view name) {
  for (const Unit& unit : kUnits) {
    if (name == unit.name) return &unit;
  }
  return nullptr;
}

absl::Status NoLength(absl::string_view text) {
  return absl::InvalidArgumentError(
      absl::StrCat("'", text,
                   "' is not a length: write a fraction of the diagonal (0.001 or 0.1%), a number "
                   "with a unit (2cm; units are ",
                   absl::StrJoin(UnitNames(), ", "), ") or one in the scan's own units (0.02u)"));
}

}  // namespace

std::vector<std::string> UnitNames() {
  std::vector<std::string> names;
  for (const Unit& unit : kUnits) names.emplace_back(unit.name);
  return names;
}

double MetresOf(absl::string_view name) {
  const Unit* unit = FindUnit(name);
  return unit != nullptr ? unit->numerator / unit->denominator : 0;
}

std::string UnitName(double metres) {
  if (!(metres > 0)) return "";
  for (const Unit& unit : kUnits) {
    if (metres == MetresOf(unit.name)) return unit.name;
  }
  return absl::StrCat(metres, " m");
}

absl::StatusOr<Length> ParseLength(absl::string_view text) {
  Length length;
  length.text = std::string(text);
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, length.value);
  if (error != std::errc() || !std::isfinite(length.value) || length.value < 0) {
    return NoLength(text);
  }
  const absl::string_view word =
      absl::StripLeadingAsciiWhitespace({after, static_cast<size_t>(end - after)});
  if (word.empty()) return length;
  if (word == "%") {
    length.value /= 100;
    return length;
  }
  if (word == "u") {
    length.of = Length::Of::kScanUnits;
  } else if (const Unit* unit = FindUnit(word); unit != nullptr) {
    length.of = Length::Of::kMetres;
    length.value = length.value * unit->numerator / unit->denominator;
  } else {
    return NoLength(text);
  }
  if (length.value > 0) return length;
  return absl::InvalidArgumentError(absl::StrCat("'", text, "' must be more than 0"));
}

CLI::Validator IsLength(double low, double high) {
  const auto check = [low, high](std::string& text) -> std::string {
    const absl::StatusOr<Length> length = ParseLength(text);
    if (!length.ok()) return std::string(length.status().message());
    if (length->of != Length::Of::kDiagonal || (length->value >= low && length->value <= high)) {
      return "";
    }
    return absl::StrCat("'", text, "' is a fraction of the diagonal, and must be from ", low,
                        " to ", high, "; a length has its unit (5mm)");
  };
  return CLI::Validator(check, "LENGTH");
}

absl::StatusOr<double> InScanUnits(const Length& length, const ScanPlace& place,
                                   const std::string& option, const std::string& scan) {
  if (length.of == Length::Of::kScanUnits) return length.value;
  if (place.metres_per_unit > 0) return length.value / place.metres_per_unit;
  return UsageError(absl::StrCat(
      option, " ", length.text, ": the unit of ", scan,
      " is not known; say with --unit what one unit of its coordinates is (--unit m), or write a "
      "fraction of the diagonal (0.1%) or a length in its own units (0.02u)"));
}

std::string LengthText(double length, const ScanPlace& place) {
  const std::string unit = UnitName(place.metres_per_unit);
  // A unit without a name has a number of its own.
  if (unit.empty() || FindUnit(unit) == nullptr) return Short(length);
  return absl::StrCat(Short(length), " ", unit);
}

}  // namespace rilievo
