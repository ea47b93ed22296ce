// Points as they come, sorted onto disk in memory that does not grow with them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_file.h"
#include "core/scan/clean/settings.h"

namespace rilievo {

// What a reconstruction takes of a scratch folder: two copies of the points, later one, with what
// is known of each of them and with heights.
inline constexpr int64_t kScratchBytesOfPoint = 60;

// An external merge sort (D. E. Knuth, The Art of Computer Programming 3, 5.4): runs of
// `run_points` are sorted in memory, then merged. Beside 64 bytes a point of a run it takes 12 KB a
// run and 1 KB a page; on disk at most 48 bytes a point.
class ScanPager {
 public:
  static constexpr int64_t kRunPoints = 1 << 20;

  // The errors of ScratchFile.
  static absl::StatusOr<ScanPager> Create(ScratchFolder folder, int64_t run_points = kRunPoints);

  // So many more will be added. RESOURCE_EXHAUSTED when the scratch folder has no room for them and
  // for what a reconstruction adds to them.
  absl::Status Expect(int64_t points);

  // Column = point, scan frame; what is not finite is counted and dropped.
  absl::Status Add(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

  // INVALID_ARGUMENT when fewer than kCheckScan.min_scan_points distinct finite points remain, and
  // where BoundingFrame() refuses them; RESOURCE_EXHAUSTED when there is no room for the pages. Of
  // duplicates only those at exactly the same place are dropped. Nothing may be added afterwards.
  // In a folder that keeps its files FindPagedScan() finds the pages again.
  absl::StatusOr<PagedScan> Finish(const RunContext& context);

  int64_t points_in() const { return figures_.points_in; }

 private:
  ScanPager(ScratchFolder folder, int64_t run_points, ScratchFile raw)
      : folder_(std::move(folder)), run_points_(run_points), raw_(std::move(raw)) {}
  void Sample(const Eigen::Vector3d& point);
  absl::Status TooFew(int64_t distinct) const;
  absl::StatusOr<Eigen::Matrix3Xd> ReadRun(int64_t begin) const;
  absl::StatusOr<SpatialFrame> FrameOf(const RunContext& context);
  absl::StatusOr<std::vector<int64_t>> SortRuns(const SpatialFrame& frame,
                                                const RunContext& context);

  ScratchFolder folder_;
  int64_t run_points_;
  ScratchFile raw_;  // points as they came; then sorted runs in their place
  PagingFigures figures_;
  int64_t expected_ = 0;
  int64_t finite_ = 0;       // points in `raw_`
  Eigen::AlignedBox3d box_;  // of these
  // Some of them, for the limit of strays; one in 2^`halvings_`, chosen by their coordinates.
  std::vector<Eigen::Vector3d> sample_;
  int halvings_ = 0;
  std::optional<Eigen::AlignedBox3d> limit_;  // points outside are strays; unset: there are none
};

}  // namespace rilievo
