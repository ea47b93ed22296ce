// Polygons given one by one, and strips, kept as triangles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {

class FaceCollector {
 public:
  // Fan of triangles from the first corner. INVALID_ARGUMENT for fewer than three corners or for
  // one that is not a whole number in [0, vertices).
  absl::Status Add(const std::vector<double>& corners, int64_t vertices) {
    if (corners.size() < 3) {
      return absl::InvalidArgumentError(absl::StrCat("a face of ", corners.size(), " corners"));
    }
    RILIEVO_RETURN_IF_ERROR(Check(corners, vertices));
    if (corners.size() != 3 && corner_counts_.empty()) {
      corner_counts_.assign(indices_.size() / 3, 3);
      has_polygons_ = true;
    }
    if (has_polygons_) corner_counts_.push_back(static_cast<int>(corners.size()));
    for (size_t i = 2; i < corners.size(); ++i) {
      AddTriangle(corners[0], corners[i - 1], corners[i]);
    }
    return absl::OkStatus();
  }

  // Strips of triangles, each but the first two corners of a strip making one with the two before
  // it, every other one the other way round; -1 ends a strip. Triangles without area that join
  // strips are left out. Errors of Add().
  absl::Status AddStrips(const std::vector<double>& corners, int64_t vertices) {
    std::vector<double> strip;
    const auto end_strip = [&]() -> absl::Status {
      RILIEVO_RETURN_IF_ERROR(Check(strip, vertices));
      for (size_t i = 2; i < strip.size(); ++i) {
        const double a = strip[i - 2], b = strip[i - 1], c = strip[i];
        if (a == b || b == c || c == a) continue;
        i % 2 == 0 ? AddTriangle(a, b, c) : AddTriangle(b, a, c);
        if (has_polygons_) corner_counts_.push_back(3);
      }
      strip.clear();
      return absl::OkStatus();
    };
    for (const double corner : corners) {
      if (corner == -1) {
        RILIEVO_RETURN_IF_ERROR(end_strip());
      } else {
        strip.push_back(corner);
      }
    }
    return end_strip();
  }

  Eigen::Matrix3Xi Finish() const {
    return Eigen::Map<const Eigen::Matrix3Xi>(indices_.data(), 3,
                                              static_cast<Eigen::Index>(indices_.size() / 3));
  }

  // Of each face in turn its number of corners; empty where all are triangles.
  const std::vector<int>& corner_counts() const { return corner_counts_; }

 private:
  static absl::Status Check(const std::vector<double>& corners, int64_t vertices) {
    for (double corner : corners) {
      if (corner >= 0 && corner < static_cast<double>(vertices) &&
          corner == static_cast<double>(static_cast<int64_t>(corner))) {
        continue;
      }
      return absl::InvalidArgumentError(
          absl::StrCat("a face names vertex ", corner, " of ", vertices));
    }
    return absl::OkStatus();
  }

  void AddTriangle(double a, double b, double c) {
    for (double corner : {a, b, c}) indices_.push_back(static_cast<int>(corner));
  }

  std::vector<int> indices_, corner_counts_;
  bool has_polygons_ = false;
};

}  // namespace rilievo
