// A point or vector in a report of --json.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace rilievo {

// [x, y, z].
inline nlohmann::ordered_json VectorJson(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace rilievo
