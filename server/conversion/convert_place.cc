#include "server/conversion/convert_place.h"

#include "absl/strings/str_cat.h"
#include "server/conversion/option_reader.h"

namespace rilievo {

static_assert(static_cast<int>(UpDirection::kX) == v1::UP_DIRECTION_X);
static_assert(static_cast<int>(UpDirection::kMinusZ) == v1::UP_DIRECTION_MINUS_Z);

ScanPlace ReadPlace(const v1::ScanPlace& from, std::vector<FieldViolation>* violations) {
  OptionReader reader("header.options.place", violations);
  ScanPlace place;
  reader.Read("metres_per_unit", from.has_metres_per_unit(), from.metres_per_unit(), {1e-12, 1e12},
              &place.metres_per_unit);
  if (v1::UpDirection_IsValid(from.up())) {
    place.up = static_cast<UpDirection>(from.up());
  } else {
    reader.Violate("up", absl::StrCat(from.up(), " is not an UpDirection"));
  }
  if (from.crs().size() <= kMaxCrsBytes) {
    place.crs = from.crs();
  } else {
    reader.Violate("crs", absl::StrCat(from.crs().size(), " bytes; at most ", kMaxCrsBytes,
                                       " are kept, name it as EPSG:NUMBER"));
  }
  return place;
}

v1::ScanPlace ProtoPlace(const ScanPlace& place) {
  v1::ScanPlace to;
  if (place.metres_per_unit > 0) to.set_metres_per_unit(place.metres_per_unit);
  if (place.up != UpDirection::kUnknown) to.set_up(static_cast<v1::UpDirection>(place.up));
  if (!place.crs.empty()) to.set_crs(place.crs);
  return to;
}

}  // namespace rilievo
