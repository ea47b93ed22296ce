// Solid angles of many dipoles at once.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/base/wide_registers.h"
#include "core/scan/orientation/dipole.h"

namespace rilievo {

// Dipoles as arrays, around a place near which they are looked at.
class DipoleList {
 public:
  explicit DipoleList(const Eigen::Vector3d& center);

  void Add(const Dipole& dipole) {
    if (count_ + kWideLanes > size()) Grow();
    const Eigen::Vector3d offset = dipole.position - center_;
    const double values[kRows] = {offset.x(),      offset.y(),      offset.z(), dipole.area.x(),
                                  dipole.area.y(), dipole.area.z(), dipole.blur};
    for (int row = 0; row < kRows; ++row) rows_[row][count_] = static_cast<float>(values[row]);
    ++count_;
  }

  // The sum of SolidAngle over all, in single precision.
  double SolidAngleAt(const Eigen::Vector3d& position) const;

 private:
  static constexpr int kRows = 7;
  int size() const { return static_cast<int>(rows_[0].size()); }
  void Grow();

  Eigen::Vector3d center_;
  // x, y, z, area, blur; behind the last dipole they are zero as far as one stretch goes.
  std::array<std::vector<float>, kRows> rows_;
  int count_ = 0;
};

}  // namespace rilievo
