#include "core/paging/scratch_surfels.h"

#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/status_macros.h"

namespace rilievo {

static_assert(sizeof(Surfel) == 20 && std::is_trivially_copyable_v<Surfel>);

absl::StatusOr<ScratchSurfels> ScratchSurfels::Create(const PagedScan& scan) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchBlocks blocks,
      ScratchBlocks::Create(scan.scratch_folder(), static_cast<int>(scan.pages().size()),
                            kPagePoints * static_cast<int64_t>(sizeof(Surfel))));
  return ScratchSurfels(std::move(blocks), scan.size());
}

absl::Status ScratchSurfels::Write(const std::vector<int64_t>& ranks,
                                   const std::vector<Surfel>& surfels) {
  size_t next = 0;
  while (next < ranks.size()) {
    const auto page = static_cast<int>(ranks[next] / kPagePoints);
    RILIEVO_ASSIGN_OR_RETURN(std::vector<Surfel> of_page, Read(page));
    for (; next < ranks.size() && ranks[next] / kPagePoints == page; ++next) {
      of_page[static_cast<size_t>(ranks[next] % kPagePoints)] = surfels[next];
    }
    RILIEVO_RETURN_IF_ERROR(WritePage(page, of_page));
  }
  return absl::OkStatus();
}

absl::Status ScratchSurfels::WritePage(int page, const std::vector<Surfel>& surfels) {
  return blocks_.Write(page, std::span(reinterpret_cast<const uint8_t*>(surfels.data()),
                                       surfels.size() * sizeof(Surfel)));
}

absl::StatusOr<std::vector<Surfel>> ScratchSurfels::Read(int page) const {
  std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, blocks_.Read(page));
  if (!bytes.empty()) std::memcpy(surfels.data(), bytes.data(), bytes.size());
  return surfels;
}

}  // namespace rilievo
