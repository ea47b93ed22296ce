// A scan too large for memory: its points on disk along a Morton curve, in pages.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"
#include "core/paging/page_stretches.h"
#include "core/paging/scratch_file.h"
#include "core/points/morton_order.h"

namespace rilievo {

// Points of a page; the last one may have fewer.
inline constexpr int kPagePoints = 4096;

struct Page {
  Eigen::AlignedBox3d box;             // of its points, scan frame
  std::vector<PageStretch> stretches;  // all of its points, in order
  uint32_t checksum = 0;               // CRC-32C

  // How many of its points lie in the box; an upper bound.
  int64_t PointsNear(const Eigen::AlignedBox3d& within) const;
};

// How many points page `page` of `size` points has.
inline int64_t PointsOfPage(int page, int64_t size) {
  return std::min<int64_t>(kPagePoints, size - int64_t{page} * kPagePoints);
}

struct PagingFigures {
  int64_t points_in = 0;
  int64_t non_finite = 0, duplicates = 0, strays = 0;  // dropped; see CheckedScan
};

// The cells of `level` are cubes of side 2^-level in the unit frame of the curve.
using CellCounts = std::array<int64_t, kMortonBits + 1>;

// Made by ScanPager, or found (FindPagedScan). Finite points, none twice, no strays (CheckedScan),
// in the order of ComputeMortonOrder.
class PagedScan {
 public:
  PagedScan(ScratchFile file, std::vector<Page> pages, int64_t size, const SpatialFrame& curve,
            const CellCounts& cells, const PagingFigures& figures)
      : file_(std::move(file)),
        pages_(std::move(pages)),
        size_(size),
        curve_(curve),
        cells_(cells),
        figures_(figures) {}

  int64_t size() const { return size_; }
  // Whose unit frame the curve fills: the box of the points.
  const SpatialFrame& curve() const { return curve_; }
  const std::vector<Page>& pages() const { return pages_; }
  // How many cells of each level hold points.
  const CellCounts& cells() const { return cells_; }
  const PagingFigures& figures() const { return figures_; }
  const ScratchFolder& scratch_folder() const { return file_.folder(); }

  // Column = point, scan frame. DATA_LOSS when the page is not what was written.
  absl::StatusOr<Eigen::Matrix3Xd> Read(int page) const;

  // All points within the box (scan frame), in order; pages of which none can are not read.
  // `ranks`, unless null, become their places in the order of all points.
  absl::StatusOr<Eigen::Matrix3Xd> PointsIn(const Eigen::AlignedBox3d& box,
                                            const RunContext& context,
                                            std::vector<int64_t>* ranks = nullptr) const;

  // For FindPagedScan().
  absl::Status Save() const;

  // All points, or, where they are more than `most`, at most so many, which lie closer together
  // where the surface bends, ends or has several sheets (CellThinner). `left_out`: by place in the
  // order of all points, those that are not chosen; empty: none. Scan frame, in order.
  absl::StatusOr<Eigen::Matrix3Xd> Thinned(int64_t most, const std::vector<bool>& left_out,
                                           const RunContext& context) const;
  // `most` of those that are not left out, as many of each part of the curve as its share, or all:
  // their noise is that of all points, where cells choose too many from the edge of thick noise.
  absl::StatusOr<Eigen::Matrix3Xd> Sampled(int64_t most, const std::vector<bool>& left_out,
                                           const RunContext& context) const;
  // About how many Thinned() are.
  int64_t ThinnedCount(int64_t most) const { return std::min(size_, most); }

 private:
  // The finest level with at most `most` cells.
  int LevelOf(int64_t most) const;
  absl::StatusOr<Eigen::Matrix3Xd> All(const RunContext& context) const;

  ScratchFile file_;
  std::vector<Page> pages_;
  int64_t size_;
  SpatialFrame curve_;
  CellCounts cells_;
  PagingFigures figures_;
};

// What ScanPager::Finish() has made in a folder that keeps its files; unset where there is nothing,
// or a page is not as it was written. CANCELLED is the only error.
absl::StatusOr<std::optional<PagedScan>> FindPagedScan(const ScratchFolder& folder,
                                                       const RunContext& context);

}  // namespace rilievo
