// Neighbours found by looking at every point.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

namespace rilievo {

// (squared distance, index) of all points, ascending.
inline std::vector<std::pair<double, int>> BruteForce(const Eigen::Matrix3Xd& points,
                                                      const Eigen::Vector3d& position) {
  std::vector<std::pair<double, int>> all;
  for (int i = 0; i < points.cols(); ++i) {
    all.emplace_back((points.col(i) - position).squaredNorm(), i);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace rilievo
