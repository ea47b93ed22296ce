// Normals, spacings and noise of a scan on disk.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
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

  // All of a page; a checksum of them.
  absl::StatusOr<uint64_t> Write(int page, const std::vector<Surfel>& surfels);
  // Takes over what an earlier run has left in the folder. `sums`: by page, what Write() has told.
  // The pages whose surfels are there as they were.
  absl::StatusOr<std::set<int>> Adopt(const std::map<int, uint64_t>& sums);
  absl::StatusOr<std::vector<Surfel>> Read(int page) const;

 private:
  ScratchSurfels(ScratchBlocks blocks, int64_t size) : blocks_(std::move(blocks)), size_(size) {}

  ScratchBlocks blocks_;
  int64_t size_;
};

}  // namespace rilievo
