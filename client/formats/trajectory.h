// Where a moving scanner was at what time.
#pragma once

#include <Eigen/Core>
#include <istream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

class Trajectory {
 public:
  // Lines of time and place: by a heading that names time (time, gps_time, gpstime, gps time, t),
  // x, y and z as xyz_heading.h does, else the first four columns; separated as NextField() has it,
  // comments start with #, // or %. Times in any order. INVALID_ARGUMENT, with the
  // line, for what is not a number, and for fewer than two times.
  static absl::StatusOr<Trajectory> Read(std::istream& in);

  // Between two places that it has linearly; NaN before the first and after the last, and within
  // gaps of more than kLongestGap seconds.
  Eigen::Vector3d At(double time) const;

  double first_time() const { return fixes_.front().time; }
  double last_time() const { return fixes_.back().time; }

  static constexpr double kLongestGap = 10;

 private:
  struct Fix {
    double time;
    Eigen::Vector3d place;
  };
  std::vector<Fix> fixes_;  // ascending times, each once, two at least
};

// Of the file; NOT_FOUND and the like as ReadScan(); an error names it.
absl::StatusOr<Trajectory> ReadTrajectory(const std::string& path);

}  // namespace rilievo
