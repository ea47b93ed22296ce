// Normals and spacings of a scan on disk.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
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
  uint32_t known = 0;  // from where: 0 not yet, 1 + a part, or kFromThinned

  static constexpr uint32_t kFromThinned = ~uint32_t{0};
  bool is_of_surface() const { return spacing > 0; }
};

// One for each point, page by page. 20 bytes a point on disk.
class ScratchSurfels {
 public:
  // The errors of ScratchBlocks.
  static absl::StatusOr<ScratchSurfels> Create(const PagedScan& scan);

  // Of the points at these ranks (PagedScan::PointsIn), ascending. A checksum of them all.
  absl::StatusOr<uint64_t> Write(const std::vector<int64_t>& ranks,
                                 const std::vector<Surfel>& surfels);
  // Takes over what an earlier run has left in the folder, but for what came of thinned points.
  // `sums`: by part, what Write() has told. The parts whose surfels are all there as they were.
  absl::StatusOr<std::set<int>> Adopt(const std::map<int, uint64_t>& sums);
  // All of a page.
  absl::Status WritePage(int page, const std::vector<Surfel>& surfels);
  absl::StatusOr<std::vector<Surfel>> Read(int page) const;

 private:
  ScratchSurfels(ScratchBlocks blocks, int64_t size) : blocks_(std::move(blocks)), size_(size) {}

  ScratchBlocks blocks_;
  int64_t size_;
};

}  // namespace rilievo
