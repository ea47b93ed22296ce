// The points of pages near a box, and the nearest of them all.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/point_pages.h"

namespace rilievo {

// Some points of pages.
struct GatheredPoints {
  // Those of one page: [begin, end) of the points.
  struct OfPage {
    int page;
    int64_t begin, end;
    int points;  // of the page, all of them
  };
  Shape shape;
  std::vector<int> places;  // of each point, in its page
  std::vector<OfPage> pages;
};

absl::StatusOr<GatheredPoints> PointsWithin(const Eigen::AlignedBox3d& box, const PointPages& pages,
                                            const RunContext& context);

// Finds what no points near by tell.
class NearestInPages {
 public:
  explicit NearestInPages(const PointPages& pages) : pages_(pages) {}

  struct Found {
    double squared_distance;
    Eigen::Vector3d point;
    double gap;
  };
  // The point nearest to `place`; unset where none is nearer than the root of `least`. Pages that
  // are farther off than what is found are not read.
  absl::StatusOr<std::optional<Found>> Search(const Eigen::Vector3d& place, double least);

 private:
  absl::StatusOr<const Shape*> Read(int page);

  const PointPages& pages_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::deque<std::pair<int, Shape>> read_;  // the last ones
};

}  // namespace rilievo
