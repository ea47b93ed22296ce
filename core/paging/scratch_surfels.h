// Normals, spacings and noise of a scan on disk.
#pragma once

#include <array>
#include <cstdint>
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
  float spacing = 0;  // 0: the point belongs to no surface
  float noise = 0;

  bool is_of_surface() const { return spacing > 0; }
};

// Whether its numbers are any, as those of bytes that were read may not be.
bool IsPossible(const Surfel& surfel);

// One for each point, page by page. 20 bytes a point on disk.
class ScratchSurfels {
 public:
  // The errors of ScratchBlocks.
  static absl::StatusOr<ScratchSurfels> Create(const PagedScan& scan);

  // All of a page.
  absl::Status Write(int page, const std::vector<Surfel>& surfels);
  // Whether those of a page are there as they were written, maybe by an earlier run.
  bool Has(int page) const;
  absl::StatusOr<std::vector<Surfel>> Read(int page) const;

 private:
  ScratchSurfels(ScratchBlocks blocks, int64_t size) : blocks_(std::move(blocks)), size_(size) {}

  std::vector<Surfel> SurfelsIn(const std::vector<uint8_t>& bytes, int page) const;

  ScratchBlocks blocks_;
  int64_t size_;
};

}  // namespace rilievo
