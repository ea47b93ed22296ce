// The stations, normals, colours and intensities of a scan's points, as a reader comes by them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/color_collector.h"
#include "client/formats/point_collector.h"
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

  // Red, green and blue.
  void AddColor(const double* channels) {
    if (wanted_.colors) colors_.Add(channels);
  }
  // Of a point that is left out.
  void SeeColor(const double* channels) {
    if (wanted_.colors) colors_.See(channels);
  }
  void set_color_kind(ColorCollector::Kind kind) { colors_.set_kind(kind); }
  // For columns that nothing calls colours. Returns what LeftOut() says of those that are not kept.
  std::string KeepCertainColors() {
    const bool certain = colors_.AreCertain();
    if (certain && colors_.known_count() == colors_.count()) return "";
    const size_t left_out = colors_.known_count();
    colors_ = {};
    return certain && left_out > 0 ? OnlySomeHave(left_out) : "";
  }

  void AddIntensity(double value) {
    if (wanted_.intensity) intensity_.push_back(static_cast<float>(value));
  }

  // Behind the name of a format, before Finish(): whether some of `points` points have colours that
  // are left out because others have none.
  std::string LeftOut(int64_t points) const {
    const auto count = static_cast<int64_t>(colors_.count());
    if (count == 0 || count == points) return "";
    return OnlySomeHave(colors_.count());
  }

  // Of `points` points; what does not have one for each is left out.
  PointSights Finish(int64_t points) {
    PointSights sights;
    if (station_count_ == points) stations_.Finish(&sights);
    if (normals_.size() == 3 * static_cast<size_t>(points)) {
      sights.normals = Eigen::Map<const Eigen::Matrix3Xf>(normals_.data(), 3, points);
    }
    sights.colors = colors_.Finish();
    if (sights.colors.size() != static_cast<size_t>(points)) sights.colors.clear();
    return sights;
  }
  // Of `points` points, or none where some have none.
  std::vector<float> FinishIntensity(int64_t points) {
    if (intensity_.size() != static_cast<size_t>(points)) intensity_.clear();
    return std::move(intensity_);
  }

 private:
  static std::string OnlySomeHave(size_t count) {
    return absl::StrCat(", without the colours that only ", count, " points have");
  }

  const WantedLayers wanted_;
  StationTable stations_;
  int64_t station_count_ = 0;
  std::vector<float> normals_;
  ColorCollector colors_;
  std::vector<float> intensity_;
};

inline Eigen::Vector3d UnknownPlace() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// The columns of a file that names them: nx, ny, nz or normal_x, normal_y, normal_z, and sensor_x,
// sensor_y, sensor_z or vp_x, vp_y, vp_z; red, green, blue or r, g, b; classification or
// scalar_Classification; intensity or scalar_Intensity.
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
    if (wanted.colors) {
      add({"red", "green", "blue"}, &color_at_);
      add({"r", "g", "b"}, &color_at_);
    }
    const auto add_one = [&](const Names& names, size_t* at) {
      for (const std::string_view name : names) {
        const int column = find(name);
        if (column < 0 || *at > 0) continue;
        *at = columns->size();
        columns->push_back(column);
      }
    };
    if (wanted.intensity) {
      add_one({"intensity", "scalar_intensity", "scalar_Intensity"}, &intensity_at_);
    }
    if (!wanted.classes.empty()) {
      add_one({"classification", "scalar_classification", "scalar_Classification"}, &class_at_);
    }
  }

  // Colours in three columns that have no names.
  void AddColorsAt(int first, std::vector<int>* columns) {
    color_at_ = columns->size();
    for (int channel = 0; channel < 3; ++channel) columns->push_back(first + channel);
  }

  // The intensity in a column that has no name.
  void AddIntensityAt(int column, std::vector<int>* columns) {
    intensity_at_ = columns->size();
    columns->push_back(column);
  }

  // The column of the red channel; -1: there are no colours.
  int color_column(const std::vector<int>& columns) const {
    return color_at_ > 0 ? columns[color_at_] : -1;
  }

  bool has_sensor() const { return sensor_at_ > 0; }

  // Adds the point, unless its class is not wanted: false then. `values`: of all columns, x, y and
  // z first.
  bool Take(const double* values, PointCollector* points, SightCollector* sights) const {
    if (class_at_ > 0 && !points->Chooses(values[class_at_])) {
      if (color_at_ > 0) sights->SeeColor(values + color_at_);
      return false;
    }
    points->Add(values[0], values[1], values[2]);
    if (normal_at_ > 0) sights->AddNormal(Eigen::Map<const Eigen::Vector3d>(values + normal_at_));
    if (sensor_at_ > 0) sights->AddStation(Eigen::Map<const Eigen::Vector3d>(values + sensor_at_));
    if (color_at_ > 0) sights->AddColor(values + color_at_);
    if (intensity_at_ > 0) sights->AddIntensity(values[intensity_at_]);
    return true;
  }

 private:
  // 0, where the coordinates are: none.
  size_t normal_at_ = 0, sensor_at_ = 0, color_at_ = 0, intensity_at_ = 0, class_at_ = 0;
};

}  // namespace rilievo
