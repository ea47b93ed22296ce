// A point set that is never in memory as a whole.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// The points that errors are measured against, in pages, with a distance for each.
class PointPages {
 public:
  virtual ~PointPages() = default;
  virtual int count() const = 0;
  // Holds the points of the page; unit frame.
  virtual Eigen::AlignedBox3d Box(int page) const = 0;
  // The points of a page, none or some, the same each time: unit frame, with gaps.
  virtual absl::StatusOr<Shape> Read(int page) const = 0;

  // Squared, one for each point of the page; infinite until it is written.
  virtual absl::StatusOr<std::vector<float>> Distances(int page) const = 0;
  virtual absl::Status WriteDistances(int page, const std::vector<float>& squared) = 0;
  // All are infinite again.
  virtual void ForgetDistances() = 0;
};

}  // namespace rilievo
