// The stations and normals of a scan's points, as a reader comes by them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "client/formats/point_layers.h"
#include "core/geometry/point_sights.h"
#include "core/geometry/station_table.h"

namespace rilievo {

class SightCollector {
 public:
  explicit SightCollector(const WantedLayers& wanted) : wanted_(wanted) {}

  // Of the next point; nothing happens where none is wanted. Places that are not finite are not
  // known.
  void AddStation(const Eigen::Vector3d& place) {
    if (!wanted_.stations) return;
    stations_.Add(place);
    ++station_count_;
  }
  void AddNormal(const Eigen::Vector3d& normal) {
    if (!wanted_.normals) return;
    for (int axis = 0; axis < 3; ++axis) normals_.push_back(static_cast<float>(normal[axis]));
  }

  // Of `points` points; what does not have one for each is left out.
  PointSights Finish(int64_t points) {
    PointSights sights;
    if (station_count_ == points) stations_.Finish(&sights);
    if (normals_.size() == 3 * static_cast<size_t>(points)) {
      sights.normals = Eigen::Map<const Eigen::Matrix3Xf>(normals_.data(), 3, points);
    }
    return sights;
  }

 private:
  const WantedLayers wanted_;
  StationTable stations_;
  int64_t station_count_ = 0;
  std::vector<float> normals_;
};

inline Eigen::Vector3d UnknownPlace() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// The columns of a file that names them: nx, ny, nz or normal_x, normal_y, normal_z, and sensor_x,
// sensor_y, sensor_z or vp_x, vp_y, vp_z.
class SightColumns {
 public:
  SightColumns() = default;

  // `find`: the number of the column with a name, negative for none. Appends the columns to read to
  // `columns`, whose values Take is given in that order.
  template <typename Find>
  SightColumns(const WantedLayers& wanted, const Find& find, std::vector<int>* columns) {
    using Names = std::string_view[3];
    const auto add = [&](const Names& names, size_t* at) {
      const int found[] = {find(names[0]), find(names[1]), find(names[2])};
      if (*at > 0 || found[0] < 0 || found[1] < 0 || found[2] < 0) return;
      *at = columns->size();
      columns->insert(columns->end(), found, found + 3);
    };
    if (wanted.normals) {
      add({"nx", "ny", "nz"}, &normal_at_);
      add({"normal_x", "normal_y", "normal_z"}, &normal_at_);
    }
    if (wanted.stations) {
      add({"sensor_x", "sensor_y", "sensor_z"}, &sensor_at_);
      add({"vp_x", "vp_y", "vp_z"}, &sensor_at_);
    }
  }

  bool has_sensor() const { return sensor_at_ > 0; }

  // `values`: of all columns.
  void Take(const double* values, SightCollector* sights) const {
    if (normal_at_ > 0) sights->AddNormal(Eigen::Map<const Eigen::Vector3d>(values + normal_at_));
    if (sensor_at_ > 0) sights->AddStation(Eigen::Map<const Eigen::Vector3d>(values + sensor_at_));
  }

 private:
  size_t normal_at_ = 0, sensor_at_ = 0;  // 0, where the coordinates are: none
};

}  // namespace rilievo
