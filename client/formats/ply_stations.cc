#include "client/formats/ply_stations.h"

#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/formats/ply_elements.h"
#include "core/base/status_macros.h"

namespace rilievo {

PlyStations::PlyStations(const PlyHeader& header, const WantedLayers& wanted) {
  if (!wanted.stations) return;
  for (size_t i = 0; i < header.elements.size(); ++i) {
    if (header.elements[i].name == "station") element_ = static_cast<int>(i);
  }
}

absl::Status PlyStations::Read(ByteSource* source, const PlyHeader& header) {
  const PlyElement& element = header.elements[static_cast<size_t>(element_)];
  std::array<int, 3> columns{};
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (size_t axis = 0; axis < 3; ++axis) {
    columns[axis] = element.Find(kAxes[axis]);
    if (columns[axis] >= 0 && !element.properties[static_cast<size_t>(columns[axis])].is_list) {
      continue;
    }
    return absl::InvalidArgumentError(
        absl::StrCat("PLY element 'station': no single scalar property '", kAxes[axis],
                     "'; give the place of each station as x, y, z"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), *source));
  PlyElementReader reader(source, header, element, columns, -1);
  for (uint64_t i = 0; i < element.count; ++i) {
    RILIEVO_RETURN_IF_ERROR(reader.Next());
    places_.push_back(Eigen::Map<const Eigen::Vector3d>(reader.scalars()));
  }
  return absl::OkStatus();
}

absl::Status PlyStations::Finish(SightCollector* sights) const {
  const auto count = static_cast<double>(places_.size());
  for (size_t i = 0; i < numbers_.size(); ++i) {
    const double number = numbers_[i];
    if (std::isnan(number) || number >= count) {
      return absl::InvalidArgumentError(absl::StrCat(
          "PLY element 'vertex' ", i, ", property 'station': ", number, " is not one of ",
          places_.size(), " stations; count from 0, -1 where it is not known"));
    }
    sights->AddStation(number < 0 ? UnknownPlace() : places_[static_cast<size_t>(number)]);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
