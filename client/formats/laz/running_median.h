// The median of recent differences, which predicts the next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace rilievo::laz {

// Five sorted values, 0 at first. A new one replaces the largest or the smallest in turn: which of
// them goes depends on which side of the middle the last ones fell, as LASzip does it.
class RunningMedian {
 public:
  int32_t Get() const { return values_[2]; }

  void Add(int32_t value) {
    int at;
    if (drop_largest_) {
      drop_largest_ = value < values_[2];
      for (at = 4; at > 0 && value < values_[static_cast<size_t>(at - 1)]; --at) {
        values_[static_cast<size_t>(at)] = values_[static_cast<size_t>(at - 1)];
      }
    } else {
      drop_largest_ = !(values_[2] < value);
      for (at = 0; at < 4 && values_[static_cast<size_t>(at + 1)] < value; ++at) {
        values_[static_cast<size_t>(at)] = values_[static_cast<size_t>(at + 1)];
      }
    }
    values_[static_cast<size_t>(at)] = value;
  }

 private:
  std::array<int32_t, 5> values_{};
  bool drop_largest_ = true;
};

}  // namespace rilievo::laz
