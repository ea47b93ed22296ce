// Distances of points from a surface that comes in parts.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/part_triangles.h"

namespace rilievo {

// A surface in parts: each of its triangles is in one.
struct SurfaceParts {
  int count = 0;
  // Part i, [0, count), the same each time. For several threads at once.
  std::function<absl::StatusOr<PartTriangles>(int i, const RunContext& context)> triangles;
  double area = 1;  // of them all, about
};

Eigen::AlignedBox3d BoxOfShape(const Shape& shape);

// Points at most this far from a part's box ask it first: of the diagonal.
inline constexpr double kNearPart = 0.01;

// Squared distances of points from the nearest of all parts.
class NearestOfParts {
 public:
  // `squared`: from those that have been asked. `points` are kept by reference.
  NearestOfParts(const Eigen::Matrix3Xd& points, std::vector<double> squared)
      : points_(points), squared_(std::move(squared)) {}

  // `reach`: points farther than that from the part's box need not ask it.
  absl::Status Ask(const Shape& part, double reach, const RunContext& context);

  // Asks all parts that may be nearer than those within kNearPart, which have been asked. `boxes`:
  // of the parts.
  absl::Status AskFarParts(const SurfaceParts& surface,
                           const std::vector<Eigen::AlignedBox3d>& boxes,
                           const RunContext& context);

  const std::vector<double>& squared() const { return squared_; }
  std::vector<double> TakeSquared() { return std::move(squared_); }

 private:
  bool MayBeNearer(const Eigen::AlignedBox3d& box) const;

  const Eigen::Matrix3Xd& points_;
  std::vector<double> squared_;
};

}  // namespace rilievo
