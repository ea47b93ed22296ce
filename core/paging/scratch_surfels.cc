#include "core/paging/scratch_surfels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

static_assert(sizeof(Surfel) == 20 && std::is_trivially_copyable_v<Surfel>);

namespace {

std::span<const uint8_t> BytesOf(const std::vector<Surfel>& surfels) {
  return {reinterpret_cast<const uint8_t*>(surfels.data()), surfels.size() * sizeof(Surfel)};
}

}  // namespace

bool IsPossible(const Surfel& surfel) {
  const auto& [x, y, z] = surfel.normal;
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z) &&
         std::isfinite(surfel.spacing) && std::isfinite(surfel.noise);
}

absl::StatusOr<ScratchSurfels> ScratchSurfels::Create(const PagedScan& scan) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchBlocks blocks,
      ScratchBlocks::Create(scan.scratch_folder(), "surfels", static_cast<int>(scan.pages().size()),
                            kPagePoints * static_cast<int64_t>(sizeof(Surfel))));
  return ScratchSurfels(std::move(blocks), scan.size());
}

absl::StatusOr<uint64_t> ScratchSurfels::Write(int page, const std::vector<Surfel>& surfels) {
  const std::span<const uint8_t> bytes = BytesOf(surfels);
  RILIEVO_RETURN_IF_ERROR(blocks_.Write(page, bytes));
  return Crc32c(bytes);
}

absl::StatusOr<std::set<int>> ScratchSurfels::Adopt(const std::map<int, uint64_t>& sums) {
  std::set<int> there;
  for (const auto& [page, sum] : sums) {
    if (page < 0 || page >= blocks_.count()) continue;
    std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes,
                             blocks_.Adopt(page, surfels.size() * sizeof(Surfel)));
    std::memcpy(surfels.data(), bytes.data(), bytes.size());
    // A checksum does not tell who wrote the bytes.
    if (Crc32c(bytes) == sum && std::all_of(surfels.begin(), surfels.end(), IsPossible)) {
      there.insert(page);
    }
  }
  return there;
}

absl::StatusOr<std::vector<Surfel>> ScratchSurfels::Read(int page) const {
  std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, blocks_.Read(page));
  if (!bytes.empty()) std::memcpy(surfels.data(), bytes.data(), bytes.size());
  return surfels;
}

}  // namespace rilievo
