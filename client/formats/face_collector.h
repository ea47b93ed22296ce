// Polygons given one by one, kept as triangles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace rilievo {

class FaceCollector {
 public:
  // Fan of triangles from the first corner. INVALID_ARGUMENT for fewer than three corners or for
  // one that is no whole number in [0, vertices).
  absl::Status Add(const std::vector<double>& corners, int64_t vertices) {
    if (corners.size() < 3) {
      return absl::InvalidArgumentError(absl::StrCat("a face of ", corners.size(), " corners"));
    }
    for (double corner : corners) {
      if (corner >= 0 && corner < static_cast<double>(vertices) &&
          corner == static_cast<double>(static_cast<int64_t>(corner))) {
        continue;
      }
      return absl::InvalidArgumentError(
          absl::StrCat("a face names vertex ", corner, " of ", vertices));
    }
    for (size_t i = 2; i < corners.size(); ++i) {
      for (double corner : {corners[0], corners[i - 1], corners[i]}) {
        indices_.push_back(static_cast<int>(corner));
      }
    }
    return absl::OkStatus();
  }

  Eigen::Matrix3Xi Finish() const {
    return Eigen::Map<const Eigen::Matrix3Xi>(indices_.data(), 3,
                                              static_cast<Eigen::Index>(indices_.size() / 3));
  }

 private:
  std::vector<int> indices_;
};

}  // namespace rilievo
