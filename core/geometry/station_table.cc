#include "core/geometry/station_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace rilievo {

StationTable::Cell StationTable::CellOf(const Eigen::Vector3d& place) const {
  Cell cell = {place.x(), place.y(), place.z()};
  if (cell_size_ == 0) return cell;
  for (double& value : cell) value = std::floor(value / cell_size_);
  return cell;
}

// Doubles the cells until half of the numbers are free.
void StationTable::Coarsen() {
  constexpr double kFirstCellShare = 1.0 / 2048;  // of the longest side that the places span
  if (cell_size_ == 0) {
    Eigen::Vector3d low = places_.front(), high = low;
    for (const Eigen::Vector3d& place : places_) {
      low = low.cwiseMin(place);
      high = high.cwiseMax(place);
    }
    cell_size_ = std::max(kFirstCellShare * (high / 2 - low / 2).maxCoeff(),
                          std::numeric_limits<double>::min());
  }
  std::vector<uint16_t> new_number(places_.size());
  do {
    cell_size_ *= 2;
    numbers_.clear();
    for (size_t i = 0; i < places_.size(); ++i) {
      const auto next = static_cast<uint16_t>(numbers_.size());
      new_number[i] = numbers_.try_emplace(CellOf(places_[i]), next).first->second;
    }
  } while (numbers_.size() > kMostStations / 2);
  std::vector<Eigen::Vector3d> kept(numbers_.size());
  for (size_t i = places_.size(); i-- > 0;) kept[new_number[i]] = places_[i];  // the first of each
  places_ = std::move(kept);
  for (uint16_t& station : station_of_) {
    if (station != kNoStation) station = new_number[station];
  }
}

uint16_t StationTable::NumberOf(const Eigen::Vector3d& place) {
  const auto known = numbers_.find(CellOf(place));
  if (known != numbers_.end()) return known->second;
  if (places_.size() == kMostStations) {
    Coarsen();
    return NumberOf(place);
  }
  const auto number = static_cast<uint16_t>(places_.size());
  numbers_.emplace(CellOf(place), number);
  places_.push_back(place);
  return number;
}

void StationTable::Add(const Eigen::Vector3d& place) {
  if (!place.allFinite()) {
    station_of_.push_back(kNoStation);
    return;
  }
  if (last_number_ == kNoStation || place != last_) {
    last_number_ = NumberOf(place);
    last_ = place;
  }
  station_of_.push_back(last_number_);
}

void StationTable::Finish(PointSights* sights) {
  StationTable table;
  std::swap(table, *this);
  if (table.places_.empty()) return;
  sights->station_of = std::move(table.station_of_);
  sights->stations.resize(3, static_cast<Eigen::Index>(table.places_.size()));
  for (size_t i = 0; i < table.places_.size(); ++i) {
    sights->stations.col(static_cast<Eigen::Index>(i)) = table.places_[i];
  }
}

}  // namespace rilievo
