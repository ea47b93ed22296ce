// Corners given one by one, those at the same place as one vertex.
#pragma once

#include <array>
#include <unordered_map>

#include "absl/hash/hash.h"
#include "client/formats/point_collector.h"

namespace rilievo {

class VertexWelder {
 public:
  // The number of the vertex there.
  int Add(double x, double y, double z) {
    // Adding zero turns -0 into 0, which is the same place.
    const std::array<double, 3> place = {x + 0.0, y + 0.0, z + 0.0};
    const auto [entry, added] = vertex_at_.try_emplace(place, static_cast<int>(points_.count()));
    if (added) points_.Add(place[0], place[1], place[2]);
    return entry->second;
  }

  int64_t count() const { return points_.count(); }

  // Column = vertex.
  Eigen::Matrix3Xd Finish() { return points_.Finish(); }

 private:
  PointCollector points_;
  std::unordered_map<std::array<double, 3>, int, absl::Hash<std::array<double, 3>>> vertex_at_;
};

}  // namespace rilievo
