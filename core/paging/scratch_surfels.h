// Normals and spacings of a scan on disk.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_blocks.h"

namespace rilievo {

// A point's share of the surface; unit frame.
struct Surfel {
  std::array<float, 3> normal = {};
  float spacing = 0;   // 0: the point belongs to no surface
  uint32_t known = 0;  // 0: not yet

  bool is_of_surface() const { return spacing > 0; }
};

// One for each point, page by page. 20 bytes a point on disk.
class ScratchSurfels {
 public:
  // The errors of ScratchBlocks.
  static absl::StatusOr<ScratchSurfels> Create(const PagedScan& scan);

  // Of the points at these ranks (PagedScan::PointsIn), ascending.
  absl::Status Write(const std::vector<int64_t>& ranks, const std::vector<Surfel>& surfels);
  // All of a page.
  absl::Status WritePage(int page, const std::vector<Surfel>& surfels);
  absl::StatusOr<std::vector<Surfel>> Read(int page) const;

 private:
  ScratchSurfels(ScratchBlocks blocks, int64_t size) : blocks_(std::move(blocks)), size_(size) {}

  ScratchBlocks blocks_;
  int64_t size_;
};

}  // namespace rilievo
