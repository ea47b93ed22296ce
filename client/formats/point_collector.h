// A growing list of points that ends as a matrix without a second copy.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <utility>

namespace rilievo {

class PointCollector {
 public:
  // Room for `count` points. Only for counts that the bytes at hold really allow.
  void Reserve(uint64_t count) { Grow(static_cast<Eigen::Index>(count)); }

  void Add(double x, double y, double z) {
    if (count_ == points_.cols()) Grow(std::max<Eigen::Index>(1024, count_ + count_ / 2));
    points_(0, count_) = x;
    points_(1, count_) = y;
    points_(2, count_) = z;
    ++count_;
  }

  int64_t count() const { return count_; }

  Eigen::Matrix3Xd Finish() {
    points_.conservativeResize(3, count_);
    return std::move(points_);
  }

 private:
  void Grow(Eigen::Index columns) {
    if (columns > points_.cols()) points_.conservativeResize(3, columns);
  }

  Eigen::Matrix3Xd points_;
  Eigen::Index count_ = 0;
};

}  // namespace rilievo
