// The points of a scan on disk, as errors are measured against.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/spatial_frame.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_blocks.h"
#include "core/paging/scratch_surfels.h"
#include "core/surface/point_pages.h"

namespace rilievo {

// PointsToMeasure() of all points that belong to the surface. 4 bytes a point on disk.
class PointsOfPages : public PointPages {
 public:
  // `frame`: the unit frame of the surfels. `scan` and `surfels` are kept by reference. The errors
  // of ScratchBlocks.
  static absl::StatusOr<PointsOfPages> Create(const PagedScan& scan, const ScratchSurfels& surfels,
                                              const SpatialFrame& frame);

  int count() const override { return static_cast<int>(scan_.pages().size()); }
  Eigen::AlignedBox3d Box(int page) const override;
  absl::StatusOr<Shape> Read(int page) const override;
  absl::StatusOr<std::vector<float>> Distances(int page) const override;
  absl::Status WriteDistances(int page, const std::vector<float>& squared) override;
  void ForgetDistances() override { distances_.Forget(); }

 private:
  PointsOfPages(const PagedScan& scan, const ScratchSurfels& surfels, const SpatialFrame& frame,
                ScratchBlocks distances)
      : scan_(scan), surfels_(surfels), frame_(frame), distances_(std::move(distances)) {}

  const PagedScan& scan_;
  const ScratchSurfels& surfels_;
  SpatialFrame frame_;
  ScratchBlocks distances_;
};

}  // namespace rilievo
