// What the coordinates of a scan stand for, as options of a command line.
#pragma once

#include <string>

#include "core/geometry/scan_place.h"

namespace CLI {
class App;
}

namespace rilievo {

struct PlaceArguments {
  std::string unit, up, crs;  // empty: not given
};

// Adds --unit and --up, which override what the file says; `arguments` must outlive the command.
void AddUnitAndUp(CLI::App* app, PlaceArguments* arguments);
// And --crs.
void AddPlaceOptions(CLI::App* app, PlaceArguments* arguments);

// What is given, in the place of what is `known`.
ScanPlace PlaceOf(const PlaceArguments& arguments, ScanPlace known);

// With what `known` says where it says nothing.
ScanPlace Completed(ScanPlace place, const ScanPlace& known);

// "z", "-x", ...; empty for kUnknown.
std::string UpName(UpDirection up);

}  // namespace rilievo
