// The places of a sensor, gathered point by point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/geometry/point_sights.h"

namespace rilievo {

// Holds each place once. A sensor that moves has one for each of its points: from kMostStations on,
// places in one cell of a grid become one, and cells grow as more come. Over the way of a sensor
// that is off by less than a thousandth of its extent.
class StationTable {
 public:
  // The place of the next point; one that is not finite is not known.
  void Add(const Eigen::Vector3d& place);

  // Of all points so far; leaves the table empty. No stations when not one is known.
  void Finish(PointSights* sights);

 private:
  using Cell = std::array<double, 3>;
  Cell CellOf(const Eigen::Vector3d& place) const;
  uint16_t NumberOf(const Eigen::Vector3d& place);
  void Coarsen();

  double cell_size_ = 0;  // 0: exact
  std::map<Cell, uint16_t> numbers_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<uint16_t> station_of_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  uint16_t last_number_ = kNoStation;
};

}  // namespace rilievo
