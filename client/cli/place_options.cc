#include "client/cli/place_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>

#include "client/cli/length_words.h"
#include "client/formats/crs_text.h"

namespace rilievo {
namespace {

// By UpDirection.
constexpr const char* kUpNames[] = {"", "x", "y", "z", "-x", "-y", "-z"};

}  // namespace

void AddUnitAndUp(CLI::App* app, PlaceArguments* arguments) {
  app->add_option("--unit", arguments->unit,
                  "what one unit of the coordinates is: km, m, dm, cm, mm, um, in, ft or us-ft; "
                  "E57 files and surfaces may say it themselves")
      ->check(CLI::IsMember(UnitNames()));
  app->add_option("--up", arguments->up,
                  "the axis that points up: x, y, z, -x, -y or -z; LAS files and surfaces may say "
                  "it themselves; z where nobody does")
      ->check(CLI::IsMember({"x", "y", "z", "-x", "-y", "-z"}));
}

void AddPlaceOptions(CLI::App* app, PlaceArguments* arguments) {
  AddUnitAndUp(app, arguments);
  app->add_option("--crs", arguments->crs,
                  "coordinate reference system, kept in the .dss: EPSG:25832, or well-known text; "
                  "none leaves out that of a LAS or E57 file");
}

ScanPlace PlaceOf(const PlaceArguments& arguments, ScanPlace known) {
  if (!arguments.unit.empty()) known.metres_per_unit = MetresOf(arguments.unit);
  if (!arguments.up.empty()) {
    const auto* name = std::find(std::begin(kUpNames), std::end(kUpNames), arguments.up);
    known.up = static_cast<UpDirection>(name - std::begin(kUpNames));
  }
  if (!arguments.crs.empty()) known.crs = arguments.crs == "none" ? "" : CrsText(arguments.crs);
  return known;
}

std::string UpName(UpDirection up) { return kUpNames[static_cast<size_t>(up)]; }

ScanPlace Completed(ScanPlace place, const ScanPlace& known) {
  if (place.metres_per_unit == 0) place.metres_per_unit = known.metres_per_unit;
  if (place.up == UpDirection::kUnknown) place.up = known.up;
  if (place.crs.empty()) place.crs = known.crs;
  return place;
}

}  // namespace rilievo
